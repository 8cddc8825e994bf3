"""Silhouettes of exported URDFs in MuJoCo's own import, beside those of our MJCF.

Each robot of the catalogue is exported with its meshes and read by MuJoCo's URDF
reader. Both models stand at `ready` on a fixed root; their visual shapes are drawn from
three sides. The intersection of two silhouettes over their union is at least 0.97.

Usage: python benchmarks/silhouettes.py [--quick] [--only TEXT] [--json FILE]
       [--keep DIR]
"""

import tempfile
from pathlib import Path

import mujoco
import numpy as np
from harness.report import Report, options
from numpy.typing import NDArray

from wbc_suite.catalogue import Catalogue
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.typing import Vector

LEAST = 0.97  # intersection over union
SIDES = {"front": 180.0, "side": 90.0, "oblique": 135.0}  # azimuth of the camera, deg
SIZE = 480  # pixels


def pose(m: mujoco.MjModel, robot: RobotDescription) -> mujoco.MjData:
    """Return the model's data at `ready`; followers follow."""
    data, ready = mujoco.MjData(m), dict(robot.keyframes.get("ready", {}))
    for joint in robot.joints:
        if joint.mimic is not None:
            leader = ready.get(joint.mimic.joint, 0.0)
            ready[joint.name] = joint.mimic.offset + joint.mimic.ratio * leader
    for name, value in ready.items():
        data.qpos[m.joint(name).qposadr[0]] = value
    mujoco.mj_forward(m, data)
    return data


def silhouettes(
    m: mujoco.MjModel, data: mujoco.MjData, at: Vector
) -> dict[str, NDArray[np.bool_]]:
    """Return the pixels of visual shapes by side, shape (SIZE, SIZE), around a point.

    The extent of the picture is the fourth number of `at`, m.
    """
    solid = (m.geom_contype | m.geom_conaffinity) > 0
    m.geom_group[:] = solid & (~solid).any()
    option = mujoco.MjvOption()
    option.geomgroup[:], option.sitegroup[:] = [1, 0, 0, 0, 0, 0], 0
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.elevation = at[:3], 1.3 * at[3], -15.0
    found: dict[str, NDArray[np.bool_]] = {}
    with mujoco.Renderer(m, SIZE, SIZE) as renderer:
        renderer.enable_segmentation_rendering()
        for side, azimuth in SIDES.items():
            camera.azimuth = azimuth
            renderer.update_scene(data, camera, scene_option=option)
            found[side] = renderer.render()[..., 1] == int(mujoco.mjtObj.mjOBJ_GEOM)
    return found


def compare(name: str, folder: Path) -> dict[str, float]:
    """Return intersection over union by side."""
    robot = load_robot(name).with_root("fixed")
    path = folder / f"{name}.urdf"
    text = robot.to_urdf(mesh_dir=folder / f"{name}_meshes")
    path.write_text(text, encoding="utf-8")
    ours, theirs = robot.to_mjspec().compile(), mujoco.MjModel.from_xml_path(str(path))
    data = pose(ours, robot)
    low = (data.geom_xpos - ours.geom_rbound[:, None]).min(axis=0)
    high = (data.geom_xpos + ours.geom_rbound[:, None]).max(axis=0)
    at = np.array([*(low + high) / 2, np.linalg.norm(high - low)])
    first = silhouettes(ours, data, at)
    second = silhouettes(theirs, pose(theirs, robot), at)
    return {
        side: float((a & b).sum() / (a | b).sum())
        for side, a, b in ((side, first[side], second[side]) for side in SIDES)
    }


def main() -> None:
    parser = options(__doc__, "three robots")
    parser.add_argument("--only", default="", help="robots whose name holds this text")
    parser.add_argument("--keep", type=Path, help="folder for the exported files")
    arguments = parser.parse_args()
    names = [n for n in Catalogue().names("robots") if arguments.only in n]
    report = Report()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for name in names[:3] if arguments.quick else names:
            found = compare(name, folder)
            report.rows.append({"case": name, "side": "MuJoCo", **found})
            worst = min(found.values())
            said = "" if worst >= LEAST else "  less than the least"
            print(f"{name:28} {worst:.4f}{said}", flush=True)
    worst = [min(row[side] for side in SIDES) for row in report.rows]
    report.ratios["silhouettes agree"] = float(np.mean(np.array(worst) >= LEAST))
    report.show_ratios()
    report.write(arguments.json)


if __name__ == "__main__":
    main()
