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
from wbc_suite.web.certificate import make_certificate
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
    "replay FILE --show browser --port 0",
    "serve-policy FILE --port 0",
)
OF_PARTS = tuple(
    line.replace("FILE", "lift.hdf5")
    for line in (*OF_RECORDINGS[:6], "replay FILE", OF_RECORDINGS[-4])
)
OF_ROBOTS = (
    "check FILE",
    *(f"export FILE --to {form} -o robot.{form}" for form in ("mjcf", "urdf", "toml")),
    "describe-action FILE",
    "render FILE -o robot.png",
    f"evaluate Lift --robots FILE {EVALUATE}",
    "view FILE --port 0",
    "adopt FILE --port 0",
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
    "expert FILE --episodes 1 --horizon 3",
)
OF_ARENAS = tuple(line.replace("FILE", "mine.toml") for line in OF_BENCHMARKS)
OF_CONTROLLERS = ("check FILE", "describe-action ROBOT --controller FILE")
CONTROLLERS = {
    "GR1": "whole_body_ik",
    "GR1FreeBody": "whole_body_id",
    "Tiago": "basic",
}
OF_JSON = (
    "check FILE --robot Panda",
    "describe-action Panda --controller FILE",
    f"evaluate Lift --controller FILE {EVALUATE}",
)
OF_KEYS = (
    "teleop Lift --robots Panda --device headset --port 0 --device-option port=0 "
    "--tls-cert certificate.pem --tls-key key.pem",
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
NESTED = """<mujoco>
 <include file="parts/joints.xml"/>
 <asset><model name="tool" file="parts/tool.xml"/></asset>
 <worldbody><body name="base"><body name="arm">
  <joint name="lift" class="slow"/><geom size="0.1" mass="1"/>
  <attach model="tool" body="tool" prefix="own_"/>
 </body></body></worldbody>
 <actuator><motor joint="lift" ctrlrange="-50 50"/></actuator>
</mujoco>
"""
PARTS = {
    "joints.xml": """<mujoco><default><default class="slow">
 <joint axis="0 0 1" range="-1 1"/></default></default></mujoco>
""",
    "tool.xml": """<mujoco>
 <asset><mesh name="m" file="link0.stl"/></asset>
 <worldbody><body name="tool"><geom type="mesh" mesh="m" mass="1"/></body></worldbody>
</mujoco>
""",
}
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


class Originals:
    """Whole files of each kind: folder, name in it, and commands that read it.

    Args:
        folder: Gets a folder for each kind.
    """

    def __init__(self, folder):
        self.folder, self.found = folder, {}

    def add(self, kind, name, commands, content, *others):
        """Write a file, and copy others beside it; return its folder."""
        path = self.folder / kind / name
        path.parent.mkdir(parents=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        for other in others:
            shutil.copy(other, path.parent)
        self.found[kind] = self.folder / kind, name, commands
        return self.folder / kind

    def add_recordings(self):
        """Add a recording, one that is not yet whole, and those of other layouts."""
        folder = self.folder
        recording(folder / "lift.hdf5")
        content = (folder / "lift.hdf5").read_bytes()
        self.add("recording", "lift.hdf5", OF_RECORDINGS, content)
        parts = folder / "parts"
        name = next(str(p.relative_to(parts)) for p in parts.glob("*/*5"))
        self.found["part"] = parts, name, OF_PARTS
        for layout in LAYOUTS[1:]:
            out = folder / f"{layout}-v0"
            converting.convert(folder / "lift.hdf5", out, layout)
            name = next(
                p
                for p in (out, *out.rglob("*"))
                if p.is_file() and p.suffix[1:] != "json"
            )
            self.add(layout, name.name, OF_RECORDINGS, name.read_bytes())

    def add_robots(self):
        """Add robots, controllers and components, shipped ones and others'."""
        panda = load_robot("Panda", gripper="none")
        self.add("mjcf", "panda.xml", OF_ROBOTS, write_scene(panda.to_mjspec()))
        self.add("urdf", "panda.urdf", OF_ROBOTS, panda.to_urdf())
        self.add("robot", "panda.toml", OF_ROBOTS, shipped("robots/arm", "panda"))
        self.add("assembly", "ur5e.toml", OF_ROBOTS, shipped("robots", "ur5e"))
        self.add("json", "mine.json", OF_JSON, JSON)
        for robot, way in CONTROLLERS.items():
            name = f"{robot.lower()}_{way}"
            lines = tuple(line.replace("ROBOT", robot) for line in OF_CONTROLLERS)
            self.add(name, f"{name}.toml", lines, shipped("controllers", name))
        for kind, name in {"gripper": "panda_gripper", "base": "rethink_mount"}.items():
            content = shipped(f"robots/{kind}", name)
            self.add(kind, f"robots/{kind}/{name}.toml", OF_COMPONENTS, content)
        self.add("skin", "robots/skin/panda.toml", OF_COMPONENTS, SKIN)

    def add_meshes(self, meshes):
        """Add meshes of a folder, and files that name them."""
        for kind in (k for k in MESHES if (meshes / f"link0.{k}").exists()):
            content = (meshes / f"link0.{kind}").read_bytes()
            own = self.add(kind, f"link0.{kind}", OF_MESHES, content)
            for end, text in {"urdf": URDF, "xml": MJCF}.items():
                (own / f"arm.{end}").write_text(text.replace("KIND", kind))
            lines = OF_COMPONENTS[-2:-1]
            own = self.add(f"skin_{kind}", f"link0.{kind}", lines, content)
            (own / "robots/skin").mkdir(parents=True)
            table = SKIN[: SKIN.index("[{")] + f'[{{ file = "link0.{kind}" }}]\n'
            (own / "robots/skin/panda.toml").write_text(table)

    def add_nested(self, mesh):
        """Add a robot in MJCF of several files; each of them is damaged."""
        files = {"nested": "arm.xml"}
        files |= {f"nested_{name[:-4]}": f"parts/{name}" for name in PARTS}
        for kind, name in files.items():
            lines = tuple(line.replace("FILE", "arm.xml") for line in OF_ROBOTS)
            own = self.add(kind, name, lines, b"")
            (own / "arm.xml").write_text(NESTED)
            (own / "parts").mkdir(exist_ok=True)
            for part, text in PARTS.items():
                (own / "parts" / part).write_text(text)
            shutil.copy(mesh, own / "parts")

    def add_scenes(self, mesh):
        """Add a benchmark, and one with an arena in MJCF, a texture and a mesh."""
        lift, folder = shipped("tasks", "lift"), self.folder
        self.add("benchmark", "lift.toml", OF_BENCHMARKS, lift)
        Image.new("RGB", (8, 8), "brown").save(folder / "wood.png")
        task = lift.decode() + '\n[arena]\nfile = "room.xml"\n'
        (folder / "mine.toml").write_text(task)
        (folder / "room.xml").write_text(ROOM)
        room = {"arena": folder / "room.xml", "texture": folder / "wood.png"}
        room |= {"stone": mesh, "task": folder / "mine.toml"}
        for kind in ("arena", "texture", "stone"):
            others = [path for other, path in room.items() if other != kind]
            content = room[kind].read_bytes()
            self.add(kind, room[kind].name, OF_ARENAS, content, *others)

    def add_keys(self):
        """Add a certificate and its key."""
        pair = [self.folder / f"{kind}.pem" for kind in ("certificate", "key")]
        make_certificate(*pair)
        for path in pair:
            self.add(path.stem, path.name, OF_KEYS, path.read_bytes(), *pair)


def shipped(folder, name):
    """Return the content of a file of the catalogue."""
    files = Catalogue().files(folder)
    return next(path for path in files if path.stem == name).read_bytes()


def write_originals(folder):
    """Write whole files of each kind; return folder, name and commands by kind."""
    originals, meshes = Originals(folder), folder / "meshes"
    originals.add_recordings()
    originals.add_robots()
    write_meshes(meshes)
    originals.add_meshes(meshes)
    originals.add_nested(meshes / "link0.stl")
    originals.add_scenes(meshes / "link0.stl")
    originals.add_keys()
    return originals.found
