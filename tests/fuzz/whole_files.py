"""One whole file of each kind that a command reads, with the commands that read it."""

import shutil
from importlib.util import find_spec

import numpy as np
from PIL import Image

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.envs.states import write_scene
from wbc_suite.evaluation import make_policy
from wbc_suite.recording import converting
from wbc_suite.robot import load_robot
from wbc_suite.robot.mesh_files import write_stl
from wbc_suite.robot.triangle_meshes import box_mesh
from wbc_suite.wrappers import DataCollection

LAYOUTS = ["robomimic", "npz", "minari", *(["mcap"] if find_spec("mcap") else [])]
SHORT = "--episodes 1 --horizon 3 --executor serial"
EVALUATE = f"--policy hold {SHORT} -o ."

OF_RECORDINGS = (
    "inspect FILE --all --columns --plots lengths.png",
    "verify FILE",
    "repair FILE",
    "merge FILE FILE -o merged.hdf5",
    "split FILE",
    "filter FILE -o filtered.hdf5 --success",
    *(f"convert FILE --to {layout} -o {layout}-v0" for layout in LAYOUTS),
    "replay FILE",
    "replay FILE --by states",
    "replay FILE --film film.webp --size 64",
    f"evaluate Lift --policy FILE {SHORT} -o out",
    "extract FILE -o extracted.hdf5 --workers 1",
    f"record Lift --device hold {SHORT} -o FILE",
    f"multiply FILE -o more.hdf5 {SHORT}",
)
OF_PARTS = tuple(
    line.replace("FILE", "lift.hdf5")
    for line in (*OF_RECORDINGS[:6], "replay FILE", OF_RECORDINGS[-2])
)
OF_ROBOTS = (
    "check FILE",
    *(f"export FILE --to {form} -o robot.{form}" for form in ("mjcf", "urdf", "toml")),
    "describe-action FILE",
    "render FILE -o robot.png",
    f"evaluate Lift --robots FILE {EVALUATE}",
)
OF_MESHES = tuple(
    line.replace("FILE", f"arm.{kind}")
    for kind in ("urdf", "xml")
    for line in OF_ROBOTS
)
OF_SKINS = ("render Panda --skin . -o robot.png",)
OF_COMPONENTS = (
    "list robots --catalogue .",
    "check FILE",
    "describe-action Panda --catalogue .",
    "render Panda --skin . --catalogue . -o robot.png",
    f"evaluate Lift --catalogue . {EVALUATE}",
)
OF_BENCHMARKS = (
    "check FILE",
    "bench FILE --actions 5",
    f"record FILE --device hold {SHORT} -o new.hdf5",
    f"evaluate FILE {EVALUATE}",
)
OF_ARENAS = tuple(line.replace("FILE", "mine.toml") for line in OF_BENCHMARKS)
OF_CONTROLLERS = ("check FILE", "describe-action ROBOT --controller FILE")
OF_JSON = (
    "check FILE --robot Panda",
    "describe-action Panda --controller FILE",
    f"evaluate Lift --controller FILE {EVALUATE}",
)
OF_RESULTS = (f"evaluate Lift {EVALUATE}",)

JSON = """{
 "type": "BASIC",
 "body_parts": {
  "right": {
   "type": "OSC_POSE", "input_max": 1, "input_min": -1, "kp": 150,
   "output_max": [0.05, 0.05, 0.05, 0.5, 0.5, 0.5],
   "output_min": [-0.05, -0.05, -0.05, -0.5, -0.5, -0.5],
   "damping_ratio": 1, "impedance_mode": "fixed", "kp_limits": [0, 300],
   "damping_ratio_limits": [0, 10], "uncouple_pos_ori": true,
   "input_type": "delta", "input_ref_frame": "base", "ramp_ratio": 0.2,
   "gripper": {"type": "GRIP"}
  }
 }
}
"""
"""A controller file in robosuite's layout."""
MESHES = ("stl", "obj", "glb", "dae")
URDF = """<robot name="arm">
 <link name="base"/>
 <joint name="lift" type="revolute">
  <parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" effort="50" velocity="2"/>
 </joint>
 <link name="arm">
  <inertial><mass value="1"/>
   <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><geometry><mesh filename="link0.KIND"/></geometry></visual>
  <collision><geometry><mesh filename="link0.KIND"/></geometry></collision>
 </link>
</robot>
"""
MJCF = """<mujoco>
 <asset><mesh name="m" file="link0.KIND"/></asset>
 <worldbody><body name="base"><body name="arm">
  <joint name="lift" axis="0 0 1" range="-1 1"/><geom type="mesh" mesh="m" mass="1"/>
 </body></body></worldbody>
 <actuator><motor joint="lift" ctrlrange="-50 50"/></actuator>
</mujoco>
"""
ROOM = """<mujoco>
 <asset>
  <texture name="t" type="2d" file="wood.png"/><material name="w" texture="t"/>
  <mesh name="m" file="link0.stl"/>
 </asset>
 <worldbody>
  <geom name="desk" type="box" size="0.4 0.4 0.4" pos="0.5 0 0.4" material="w"/>
  <geom name="stone" type="mesh" mesh="m" pos="2 0 0.1"/>
 </worldbody>
</mujoco>
"""
COLLADA = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
 <library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="a" count="12">0 0 0 .1 0 0 0 .1 0 0 0 .1</float_array>
   <technique_common><accessor source="#a" count="4" stride="3">
    <param name="X" type="float"/><param name="Y" type="float"/>
    <param name="Z" type="float"/></accessor></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
   <p>0 2 1 0 1 3 1 2 3 0 3 2</p></triangles>
 </mesh></geometry></library_geometries>
 <library_visual_scenes><visual_scene id="s"><node id="n">
  <instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"""
SKIN = """format = 1
provider = "robosuite"

[link]
panda_link0 = [{ file = "link0.obj" }, { file = "link0.stl" }, { file = "link0.glb" }]
"""


def recording(path):
    """Write what is damaged: two short episodes of Lift; keep those beside the file."""
    made = wbc_suite.make("Lift", robots="Panda", horizon=6)
    with_file = DataCollection(made, path)
    driver = make_policy("expert", made, 0)
    for seed in range(2):
        seen, _ = with_file.reset(seed=seed)
        for _ in range(6):
            seen, *_ = with_file.step(driver(seen))
    beside = path.with_name(path.name + ".parts")
    shutil.copytree(beside, path.parent / "parts" / beside.name)
    with_file.close()


def write_meshes(folder):
    """Write a box in each format that holds triangles."""
    folder.mkdir()
    mesh = box_mesh(np.full(3, 0.05))
    write_stl(folder / "link0.stl", mesh.vertices, mesh.faces)
    rows = [("v", *row) for row in mesh.vertices]
    rows += [("f", *row) for row in mesh.faces + 1]
    (folder / "link0.obj").write_text("\n".join(" ".join(map(str, r)) for r in rows))
    (folder / "link0.dae").write_text(COLLADA)
    if find_spec("trimesh"):
        import trimesh

        trimesh.Trimesh(mesh.vertices, mesh.faces).export(folder / "link0.glb")


def write_originals(folder):
    """Write the files; return folder, name in it and commands of each kind."""
    shipped = {
        path.stem: path
        for kind in ("tasks", "controllers", "robots/arm", "robots")
        for path in Catalogue().files(kind)
    }
    found = {}

    def add(kind, name, commands, content, *others):
        path = folder / kind / name
        path.parent.mkdir(parents=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        for other in others:
            shutil.copy(other, path.parent)
        found[kind] = folder / kind, name, commands

    recording(folder / "lift.hdf5")
    add("recording", "lift.hdf5", OF_RECORDINGS, (folder / "lift.hdf5").read_bytes())
    found["part"] = (
        folder / "parts",
        next(str(p.relative_to(folder / "parts")) for p in folder.glob("parts/*/*5")),
        OF_PARTS,
    )
    for layout in LAYOUTS[1:]:
        out = folder / f"{layout}-v0"
        converting.convert(folder / "lift.hdf5", out, layout)
        name = next(
            p for p in (out, *out.rglob("*")) if p.is_file() and p.suffix[1:] != "json"
        )
        add(layout, name.name, OF_RECORDINGS, name.read_bytes())
    panda = load_robot("Panda", gripper="none")
    add("mjcf", "panda.xml", OF_ROBOTS, write_scene(panda.to_mjspec()))
    add("urdf", "panda.urdf", OF_ROBOTS, panda.to_urdf())
    add(
        "robot",
        "panda.toml",
        OF_ROBOTS,
        Catalogue().find("robots/arm", "panda", kind="").read_bytes(),
    )
    add("assembly", "ur5e.toml", OF_ROBOTS, shipped["ur5e"].read_bytes())
    add("json", "mine.json", OF_JSON, JSON)
    add("benchmark", "lift.toml", OF_BENCHMARKS, shipped["lift"].read_bytes())
    for robot, way in {"GR1": "ik", "GR1FreeBody": "id"}.items():
        name = f"{robot.lower()}_whole_body_{way}"
        lines = tuple(line.replace("ROBOT", robot) for line in OF_CONTROLLERS)
        add(name, f"{name}.toml", lines, shipped[name].read_bytes())
    for kind, name in {"gripper": "panda_gripper", "base": "rethink_mount"}.items():
        path = Catalogue().find(f"robots/{kind}", name, kind=kind)
        place = f"robots/{kind}/{name}.toml"
        add(kind, place, OF_COMPONENTS, path.read_bytes())
    add("skin", "robots/skin/panda.toml", OF_COMPONENTS, SKIN)
    meshes = folder / "meshes"
    write_meshes(meshes)
    for kind in (k for k in MESHES if (meshes / f"link0.{k}").exists()):
        content = (meshes / f"link0.{kind}").read_bytes()
        add(kind, f"link0.{kind}", OF_MESHES, content)
        for end, text in {"urdf": URDF, "xml": MJCF}.items():
            (folder / kind / f"arm.{end}").write_text(text.replace("KIND", kind))
        add(f"skin_{kind}", f"link0.{kind}", OF_COMPONENTS[-2:-1], content)
        (folder / f"skin_{kind}/robots/skin").mkdir(parents=True)
        table = SKIN[: SKIN.index("[{")] + f'[{{ file = "link0.{kind}" }}]\n'
        (folder / f"skin_{kind}/robots/skin/panda.toml").write_text(table)
    Image.new("RGB", (8, 8), "brown").save(folder / "wood.png")
    stone = meshes / "link0.stl"
    task = shipped["lift"].read_text() + '\n[arena]\nfile = "room.xml"\n'
    (folder / "mine.toml").write_text(task)
    (folder / "room.xml").write_text(ROOM)
    room = folder / "room.xml", folder / "mine.toml", folder / "wood.png", stone
    for kind, path in zip(
        ("arena", "texture", "stone"), (room[0], *room[2:]), strict=True
    ):
        add(
            kind,
            path.name,
            OF_ARENAS,
            path.read_bytes(),
            *(p for p in room if p != path),
        )
    return found
