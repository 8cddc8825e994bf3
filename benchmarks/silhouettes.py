"""Silhouettes of exported URDFs in other readers, against those of our MJCF.

Each robot of the catalogue is exported with its meshes and read by MuJoCo, Pinocchio
and yourdfpy (`pip install yourdfpy`; left out if absent). All models stand at `ready`
on a fixed root; MuJoCo draws their visual shapes from three sides. The intersection of
two silhouettes over their union is at least 0.97.

Usage: MUJOCO_GL=egl python benchmarks/silhouettes.py [--quick] [--only TEXT]
       [--json FILE] [--keep DIR] [--table]
"""

import importlib.util
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import coal
import mujoco
import numpy as np
import pinocchio as pin
import trimesh
from harness.report import Report, options, write_between, written_by

from wbc_suite.catalogue import Catalogue
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.viewers.silhouettes import SIDES, silhouettes, surroundings

LEAST = 0.97  # intersection over union
PAGE = Path(__file__).parents[1] / "docs" / "robots.md"
MARKS = "<!-- silhouettes -->", "<!-- end of silhouettes -->"


def posture(robot: RobotDescription) -> dict[str, float]:
    """Return the positions of all joints at `ready`; followers follow."""
    ready = dict(robot.keyframes.get("ready", {}))
    for joint in robot.joints:
        if joint.mimic is not None:
            leader = ready.get(joint.mimic.joint, 0.0)
            ready[joint.name] = joint.mimic.offset + joint.mimic.ratio * leader
    return ready


def pose(m: mujoco.MjModel, robot: RobotDescription) -> mujoco.MjData:
    """Return the model's data at `ready`."""
    data = mujoco.MjData(m)
    for name, value in posture(robot).items():
        data.qpos[m.joint(name).qposadr[0]] = value
    mujoco.mj_forward(m, data)
    return data


def in_pinocchio(path: Path, robot: RobotDescription) -> Iterator[trimesh.Trimesh]:
    """Yield the visual shapes of Pinocchio's model of a file, in the world."""
    model = pin.buildModelFromUrdf(str(path))
    shapes = pin.buildGeomFromUrdf(
        model, str(path), pin.VISUAL, package_dirs=[str(path.parent)]
    )
    q = pin.neutral(model)
    for name, value in posture(robot).items():
        joint = model.joints[model.getJointId(name)]
        endless = joint.nq == 2  # cosine and sine
        values = (np.cos(value), np.sin(value)) if endless else value
        q[joint.idx_q : joint.idx_q + joint.nq] = values
    placed = shapes.createData()
    pin.updateGeometryPlacements(model, model.createData(), shapes, placed, q)
    for shape, T in zip(shapes.geometryObjects, placed.oMg, strict=True):
        mesh = triangles(shape)
        yield mesh.apply_transform(T.homogeneous)


def triangles(shape: pin.GeometryObject) -> trimesh.Trimesh:
    """Return the surface of a shape of Pinocchio's, in its own axes."""
    solid = shape.geometry
    if isinstance(solid, coal.Box):
        return trimesh.creation.box(extents=2 * solid.halfSide)
    if isinstance(solid, coal.Sphere):
        return trimesh.creation.icosphere(radius=solid.radius)
    if isinstance(solid, coal.Cylinder):
        height = 2 * solid.halfLength
        return trimesh.creation.cylinder(radius=solid.radius, height=height)
    return trimesh.load_mesh(shape.meshPath).apply_scale(shape.meshScale)


def in_yourdfpy(path: Path, robot: RobotDescription) -> Iterator[trimesh.Trimesh]:
    """Yield the visual shapes of yourdfpy's scene of a file, in the world."""
    import yourdfpy

    urdf = yourdfpy.URDF.load(str(path))
    ready = posture(robot)
    urdf.update_cfg({name: ready.get(name, 0.0) for name in urdf.actuated_joint_names})
    yield from urdf.scene.dump()


def still(meshes: Iterator[trimesh.Trimesh]) -> mujoco.MjModel:
    """Return a model of meshes that are fixed in the world."""
    spec = mujoco.MjSpec()
    for k, mesh in enumerate(meshes):
        own = spec.add_mesh(
            name=f"{k}", inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        )
        own.uservert, own.userface = mesh.vertices.ravel(), mesh.faces.ravel()
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"{k}", contype=0, conaffinity=0
        )
    return spec.compile()


def compare(name: str, folder: Path) -> dict[str, dict[str, float]]:
    """Return intersection over union by reader and side."""
    robot = load_robot(name).with_root("fixed")
    path = folder / f"{name}.urdf"
    text = robot.to_urdf(mesh_dir=folder / f"{name}_meshes")
    path.write_text(text, encoding="utf-8")
    ours = robot.to_mjspec().compile()
    data = pose(ours, robot)
    at = surroundings(ours, data)
    first = silhouettes(ours, data, at)
    read = mujoco.MjModel.from_xml_path(str(path))
    others = {"MuJoCo": (read, pose(read, robot))}
    readers = {"Pinocchio": in_pinocchio}
    if importlib.util.find_spec("yourdfpy"):
        readers["yourdfpy"] = in_yourdfpy
    for reader, shapes in readers.items():
        m = still(shapes(path, robot))
        others[reader] = m, mujoco.MjData(m)
        mujoco.mj_forward(*others[reader])
    found: dict[str, dict[str, float]] = {}
    for reader, (m, own) in others.items():
        drawn = silhouettes(m, own, at)
        pairs = {side: (first[side], drawn[side]) for side in SIDES}
        found[reader] = {
            side: float((a & b).sum() / (a | b).sum()) for side, (a, b) in pairs.items()
        }
    return found


def table(rows: list[dict[str, Any]]) -> str:
    """Return the worst silhouette by reader as a table in Markdown."""
    lines = [
        f"| reader | robots | of them {LEAST} or more | least | of |",
        "| --- | ---: | ---: | ---: | --- |",
    ]
    for reader in dict.fromkeys(row["reader"] for row in rows):
        found = [(row["worst"], row["case"]) for row in rows if row["reader"] == reader]
        (least, name), good = min(found), sum(worst >= LEAST for worst, _ in found)
        lines.append(f"| {reader} | {len(found)} | {good} | {least:.4f} | {name} |")
    return "\n".join([*lines, "", written_by("silhouettes.py --table")])


def main() -> None:
    parser = options(__doc__, "three robots")
    parser.add_argument("--only", default="", help="robots whose name holds this text")
    parser.add_argument("--keep", type=Path, help="folder for the exported files")
    parser.add_argument("--table", action="store_true", help=f"write to {PAGE.name}")
    arguments = parser.parse_args()
    names = [n for n in Catalogue().names("robots") if arguments.only in n]
    report = Report()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for name in names[:3] if arguments.quick else names:
            for reader, found in compare(name, folder).items():
                worst = min(found.values())
                row = {"case": name, "reader": reader, "worst": worst, **found}
                report.rows.append(row)
                said = "" if worst >= LEAST else "  less than the least"
                print(f"{name:28} {reader:9} {worst:.4f}{said}", flush=True)
    good = [row["worst"] >= LEAST for row in report.rows]
    report.ratios["silhouettes agree"] = float(np.mean(good))
    report.show_ratios()
    report.write(arguments.json)
    if arguments.table:
        write_between(PAGE, table(report.rows), MARKS)


if __name__ == "__main__":
    main()
