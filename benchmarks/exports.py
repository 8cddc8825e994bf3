"""Exports of every robot in their readers: poses, mass, pairs, against our own model.

Each robot of the catalogue is written for each reader. Readers load it in environments
of their own (`make bench-peers`; a reader without one is left out) and place all links
and frames at 20 random configurations, in which followers follow. Poses agree to 1e-6,
masses to 1 g. Pairs of links that an SRDF or Drake lets collide are ours.

Usage: python benchmarks/exports.py [--quick] [--only TEXT] [--json FILE]
       [--environments DIR] [--table]
"""

import importlib.util
import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from harness.report import Report, options, write_between, written_by

from wbc_suite.catalogue import Catalogue
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.robot.collision_capsules import collision_pairs
from wbc_suite.robot.readers.export import EXPORTS, export_for

HERE = Path(__file__).parent
PAGE = HERE.parent / "docs" / "robots.md"
MARKS = "<!-- exports -->", "<!-- end of exports -->"
CONFIGURATIONS = 20
POSE, MASS = 1e-6, 1e-3  # largest deviations, m or of rotation matrices, and kg
SIDES = ("pybullet", "yourdfpy", "placo", "drake", "usd")
Row = dict[str, Any]
Values = Mapping[str, float]


def random_values(robot: RobotDescription, rng: np.random.Generator) -> Values:
    """Return positions of all joints, and of a planar root."""
    given = {j.name: rng.uniform(*(j.range or (-3.0, 3.0))) for j in robot.joints}
    root = {joint.name: rng.uniform(-1.0, 1.0) for joint in robot.root.joints}
    return root | robot.posture(given)


def our_poses(robot: RobotDescription, values: list[Values]) -> np.ndarray:
    """Return poses (n, frames, 4, 4) of links and frames in our Pinocchio model."""
    model = robot.to_pinocchio()
    data, q = model.createData(), pin.neutral(model)
    frames = [model.getFrameId(link.name, pin.BODY) for link in robot.links]
    frames += [model.getFrameId(frame.name, pin.OP_FRAME) for frame in robot.frames]
    poses = []
    for own in values:
        for name, value in own.items():
            q[model.joints[model.getJointId(name)].idx_q] = value
        pin.framesForwardKinematics(model, data, q)
        poses.append([data.oMf[frame].homogeneous.copy() for frame in frames])
    return np.array(poses)


def write_case(name: str, folder: Path) -> tuple[RobotDescription, Path]:
    """Export a robot for all readers, and write what is expected beside."""
    robot = load_robot(name)
    own = folder / name
    for reader in EXPORTS:
        export_for(robot, reader, own / reader)
    plain = own / "plain" / "robot.urdf"
    plain.parent.mkdir()
    text = robot.to_urdf(mesh_dir=plain.parent / "meshes")
    plain.write_text(text, encoding="utf-8")
    rng = np.random.default_rng(0)
    values = [random_values(robot, rng) for _ in range(CONFIGURATIONS)]
    fixed = robot.root.kind == "fixed"
    chained = robot.root.kind != "free"
    rooted = dict(yourdfpy=fixed, placo=False, pybullet=chained, drake=chained)
    rooted["usd"] = False
    kinds = {"yourdfpy": "plain", "placo": "pinocchio", "usd": "isaac"}
    at_zero = dict.fromkeys(values[0], 0.0)
    content: dict[str, Any] = {
        "joints": list(values[0]),
        "values": [list(row.values()) for row in values],
        "frames": [x.name for x in (*robot.links, *robot.frames)],
        "poses": our_poses(robot, values),
        "zeros": [list(at_zero.values())],
        "poses_at_zero": our_poses(robot, [at_zero]),
        "mass": robot.mass,
        "pairs": [sorted(pair) for pair in collision_pairs(robot)],
    }
    for reader in SIDES:
        kind = "*.xml" if reader == "usd" else "*.urdf"
        file = next((own / kinds.get(reader, reader)).glob(kind))
        content[f"file_{reader}"] = str(file.relative_to(own))
        content[f"rooted_{reader}"] = rooted[reader]
    np.savez(folder / f"{name}.npz", **content)
    return robot, own


def in_mujoco(path: Path, case: Path) -> Row:
    """Return deviations of poses and mass of a URDF or MJCF file in MuJoCo.

    Frames are bodies in a URDF, and sites in an MJCF.
    """
    m, data = mujoco.MjModel.from_xml_path(str(path)), np.load(case)
    d, worst = mujoco.MjData(m), 0.0
    bodies = [m.body(i).name for i in range(1, m.nbody)]
    sites = [m.site(i).name for i in range(m.nsite)]
    first, names = bodies[0], data["frames"].tolist()
    assert {*bodies, *sites} == set(names)
    for values, expected in zip(data["values"], data["poses"], strict=True):
        for name, value in zip(data["joints"].tolist(), values, strict=True):
            if not name.startswith("root_"):
                d.qpos[m.joint(name).qposadr[0]] = value
        mujoco.mj_kinematics(m, d)
        own, ours = matrix(d.body(first)), expected[names.index(first)]
        base = ours @ np.linalg.inv(own)
        found = [(name, matrix(d.body(name))) for name in bodies]
        found += [(name, matrix(d.site(name))) for name in sites]
        for name, T in found:
            worst = max(worst, np.abs(base @ T - expected[names.index(name)]).max())
    return {"pose": float(worst), "mass": abs(float(m.body_mass.sum() - data["mass"]))}


def matrix(item: Any) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = item.xmat.reshape(3, 3), item.xpos
    return T


def in_pinocchio(robot: RobotDescription, folder: Path, case: Path) -> Row:
    """Return deviations in Pinocchio, with a root joint of its own, and of the SRDF."""
    data = np.load(case)
    urdf, srdf = (str(next(folder.glob(f"*.{kind}"))) for kind in ("urdf", "srdf"))
    roots = {"planar": pin.JointModelPlanar, "free": pin.JointModelFreeFlyer}
    root = [roots[robot.root.kind]()] if robot.root.kind in roots else []
    model = pin.buildModelFromUrdf(urdf, *root)
    own, q, worst = model.createData(), pin.neutral(model), 0.0
    for values, expected in zip(data["values"], data["poses"], strict=True):
        for name, value in zip(data["joints"].tolist(), values, strict=True):
            if model.existJointName(name):
                joint = model.joints[model.getJointId(name)]
                turn = (np.cos(value), np.sin(value))
                q[joint.idx_q : joint.idx_q + joint.nq] = (
                    turn if joint.nq == 2 else value
                )
        pin.framesForwardKinematics(model, own, q)
        names = data["frames"].tolist()
        found = [own.oMf[model.getFrameId(n, pin.BODY)].homogeneous for n in names]
        base = expected[0] @ np.linalg.inv(found[0])
        worst = max(
            worst,
            *(np.abs(base @ T - E).max() for T, E in zip(found, expected, strict=True)),
        )
    own_mass = sum(inertia.mass for inertia in model.inertias)  # the universe's, too
    mass = abs(own_mass - float(data["mass"]))
    return {
        "pose": float(worst),
        "mass": float(mass),
        "pairs": pairs_differ(robot, model, urdf, srdf),
    }


def pairs_differ(robot: RobotDescription, model: Any, urdf: str, srdf: str) -> int:
    """Return the number of pairs that only one of SRDF and robot lets collide."""
    packages = [str(Path(urdf).parent)]
    shapes = pin.buildGeomFromUrdf(model, urdf, pin.COLLISION, package_dirs=packages)
    shapes.addAllCollisionPairs()
    pin.removeCollisionPairs(model, shapes, srdf)
    link = [model.frames[g.parentFrame].name for g in shapes.geometryObjects]
    enabled = {
        frozenset((link[p.first], link[p.second])) for p in shapes.collisionPairs
    }
    return len(enabled ^ collision_pairs(robot))


def python_of(reader: str, environments: Path) -> Path | None:
    """Return the interpreter of a reader's environment, or None if there is none."""
    if importlib.util.find_spec(reader):
        return Path(sys.executable)
    for folder in (environments / f".venv-{reader}", environments / reader):
        if (folder / "bin" / "python").is_file():
            return folder / "bin" / "python"
    return None


def aside(reader: str, folder: Path, python: Path) -> dict[str, Row]:
    """Return the deviations by robot that a reader finds in its own environment."""
    command = [
        str(python),
        str(HERE / "peers" / "exports_side.py"),
        reader,
        str(folder),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{reader}: {done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def agrees(row: Row) -> bool:
    return (
        "error" not in row
        and row["pose"] <= POSE
        and row["mass"] <= MASS
        and not row.get("pairs")
    )


def table(rows: list[Row]) -> str:
    """Return the agreement by reader as a table in Markdown."""
    lines = [
        "| reader | robots | agree | largest deviation of poses | of mass, g |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for reader in dict.fromkeys(row["side"] for row in rows):
        own = [row for row in rows if row["side"] == reader]
        poses = max(row.get("pose", np.inf) for row in own)
        masses = max(row.get("mass", np.inf) for row in own)
        cells = (
            reader,
            len(own),
            sum(map(agrees, own)),
            f"{poses:.0e}",
            f"{1e3 * masses:.2g}",
        )
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join([*lines, "", written_by("exports.py --table")])


def main() -> None:
    parser = options(__doc__, "three robots")
    parser.add_argument("--only", default="", help="robots whose name holds this text")
    parser.add_argument("--environments", type=Path, default=HERE.parent)
    parser.add_argument("--table", action="store_true", help=f"write to {PAGE.name}")
    arguments = parser.parse_args()
    names = [n for n in Catalogue().names("robots") if arguments.only in n]
    report = Report()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name in names[::20] if arguments.quick else names:
            robot, own = write_case(name, folder)
            case = folder / f"{name}.npz"
            plain = own / "plain" / "robot.urdf"
            mjcf = next((own / "isaac").glob("*.xml"))
            found = {
                "MuJoCo, URDF": in_mujoco(plain, case),
                "MuJoCo, MJCF": in_mujoco(mjcf, case),
                "Pinocchio": in_pinocchio(robot, own / "pinocchio", case),
            }
            report.rows += [
                {"case": name, "side": k, **row} for k, row in found.items()
            ]
            print(name, flush=True)
        for reader in SIDES:
            if (python := python_of(reader, arguments.environments)) is None:
                print(f"{reader}: no environment")
                continue
            for name, row in aside(reader, folder, python).items():
                report.rows.append({"case": name, "side": reader, **row})
    for row in report.rows:
        if not agrees(row):
            print(row)
    print(table(report.rows))
    report.ratios["exports agree"] = float(
        np.mean([agrees(row) for row in report.rows])
    )
    report.show_ratios()
    report.write(arguments.json)
    if arguments.table:
        write_between(PAGE, table(report.rows), MARKS)


if __name__ == "__main__":
    main()
