"""Whole-body inverse kinematics, compared with pink, mink and placo.

Each robot has the tasks that fit it: hands, feet, centre of mass, posture; position and
velocity limits; hands on Lissajous paths. Ours, pink and mink take turns tick by tick
in one process: same model, tasks, costs, gain, damping, limits, and daqp as the solver.
"ours" tries the last tick's active set before it asks daqp; "ours, daqp" always asks.
placo runs in its own environment (.venv-placo), on our URDF; it has no gain and its own
solver. It takes its turns in another process, on the same processor; "alone" are ours
and placo in turns of 50 ticks, which leaves caches warm.

Times are CPU times of the thread, in microseconds, so that other work on the machine
counts less. The QP of "ours" is timed by solving it once more: inside the compiled tick
there is no clock. A peer that is not installed is left out: `make bench-peers`.

Usage: python benchmarks/whole_body_ik.py [--quick] [--json FILE] [--ticks N]
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from harness.report import Report, options

import numpy as np  # isort: skip  (after harness: it sets the number of threads)
import pinocchio as pin

import wbc_suite
from wbc_suite.compiling import as_argument
from wbc_suite.kinematics import Configuration, Conversion
from wbc_suite.qp import (
    ComTask,
    FrameTask,
    PositionLimit,
    PostureTask,
    TaskStack,
    VelocityLimit,
)
from wbc_suite.qp.active_set import solve_warm

DT = 5e-3  # s
GAIN = 0.5  # of every task
DAMPING = 1e-3  # [cost]^2/rad^2
LIMIT_GAIN = 0.95  # share of the distance to a position limit in one tick
POSTURE_COST = 1e-2
TURN = 50  # ticks of "alone"
clock = time.thread_time_ns


@dataclass(frozen=True, kw_only=True)
class Case:
    """A robot with the frames it tracks and holds."""

    robot: str
    root: Literal["fixed", "planar", "free"] | None = None
    hands: tuple[str, ...]
    feet: tuple[str, ...] = ()
    com: bool = False
    path: float = 1.0  # size of the hands' paths; smaller for shorter arms
    description: wbc_suite.robot.RobotDescription = field(init=False)
    model: pin.Model = field(init=False)
    q: np.ndarray = field(init=False)

    def __post_init__(self):
        robot = wbc_suite.load_robot(self.robot, root=self.root)
        model = robot.to_pinocchio()
        q = pin.neutral(model)
        for joint, value in robot.keyframes["ready"].items():
            q[model.joints[model.getJointId(joint)].idx_q] = value
        bounded = model.upperPositionLimit < 1e10
        lower, upper = model.lowerPositionLimit, model.upperPositionLimit
        q[bounded] = np.clip(q, lower, upper)[bounded]
        object.__setattr__(self, "description", robot)
        object.__setattr__(self, "model", model)
        object.__setattr__(self, "q", q)

    @property
    def frames(self):
        return (*self.hands, *self.feet)

    def targets(self, ticks: int) -> np.ndarray:
        """Return homogeneous poses, shape (ticks, frames, 4, 4); feet stand."""
        robot = Configuration(self.model, self.q)
        start = np.array([robot.frame_pose(f).homogeneous for f in self.frames])
        poses = np.tile(start, (ticks, 1, 1, 1))
        t = np.arange(ticks) * DT
        for k in range(len(self.hands)):
            side = 1.0 if k == 0 else -1.0
            poses[:, k, 0, 3] += self.path * 0.08 * np.sin(2 * np.pi * 0.23 * t)
            poses[:, k, 1, 3] += self.path * side * 0.10 * np.sin(2 * np.pi * 0.17 * t)
            poses[:, k, 2, 3] += self.path * 0.08 * np.sin(2 * np.pi * 0.31 * t)
            angle = self.path * 0.3 * np.sin(2 * np.pi * 0.19 * t)
            for n in range(ticks):
                turn = pin.exp3(np.array([0.0, angle[n], side * angle[n]]))
                poses[n, k, :3, :3] = turn @ start[k, :3, :3]
        return poses


CASES = (
    Case(
        robot="GR1",
        root="free",
        hands=("right_eef", "left_eef"),
        feet=("right_foot", "left_foot"),
        com=True,
    ),
    Case(robot="Tiago", hands=("right_eef", "left_eef"), com=True, path=0.6),
    Case(robot="Panda", hands=("right_eef",), path=0.5),
)


@dataclass
class Record:
    """Times in us and states of one side, one entry per tick."""

    kinematics: list = field(default_factory=list)
    rows: list = field(default_factory=list)
    qp: list = field(default_factory=list)
    total: list = field(default_factory=list)
    q: list = field(default_factory=list)
    v: list = field(default_factory=list)
    failed: int = 0


class Ours:
    """This package: on the peers' problem, or with its own defaults."""

    def __init__(self, case: Case, targets, *, defaults=False, warm=True):
        self.robot = Configuration(case.model, case.q)
        self.frames = [FrameTask(f, gain=GAIN) for f in case.frames]
        tasks = [*self.frames, *([ComTask(gain=GAIN)] if case.com else [])]
        root = {n: POSTURE_COST for n in case.model.names if n.startswith("root_")}
        tasks.append(PostureTask(POSTURE_COST, gain=GAIN, costs=root, max_speed=1e3))
        limits = [
            PositionLimit(gain=LIMIT_GAIN),
            VelocityLimit(base_linear=np.inf, base_angular=np.inf)
            if case.root == "free"
            else VelocityLimit(),
        ]
        options = {"limits": limits, "joint_limits": False}
        options |= {"curvature_damping": 0.0, "escape": False}
        self.stack = TaskStack(
            self.robot,
            tasks,
            damping=DAMPING,
            warm=warm,
            **({} if defaults else options),
        )
        level = self.stack._level_solver
        self.solver = level.solver = Timed(level.solver)
        self.targets = [[pin.SE3(T) for T in tick] for tick in targets]
        self.q = case.q.copy()

    def tick(self, k: int, record: Record) -> None:
        self.solver.spent = 0
        t0 = clock()
        self.robot.update(self.q)
        t1 = clock()
        for task, target in zip(self.frames, self.targets[k], strict=True):
            task.set_target(target)
        solution = self.stack.solve(DT)
        t2 = clock()
        self.q = self.robot.integrate(solution.dq)
        t3 = clock()
        spent = self.solver.spent or self.once_more()
        note(record, t0, t1, t2 - spent, t2, t3)
        record.q.append(self.q)
        record.v.append(solution.v)
        record.failed += not solution.ok

    def once_more(self) -> int:
        """Solve the tick's QP again, ns: inside the compiled tick there is no clock."""
        qp = as_argument(self.stack.levels[0].qp)
        start = clock()
        solve_warm(qp)
        return clock() - start


class Timed:
    """A solver with a clock."""

    def __init__(self, solver):
        self.solver, self.spent = solver, 0

    def solve(self, problem):
        start = clock()
        result = self.solver.solve(problem)
        self.spent += clock() - start
        return result

    def fresh(self):
        return Timed(self.solver.fresh())


class Pink:
    def __init__(self, case: Case, targets):
        import pink  # pyright: ignore[reportMissingImports]
        import qpsolvers

        model = case.model.copy()
        if case.root == "free":
            model.names[1] = "root_joint"  # how pink knows a floating base
            model.velocityLimit[:6] = np.inf
        self.pink, self.solve = pink, qpsolvers.solve_problem
        self.robot = pink.Configuration(model, model.createData(), case.q)
        self.frames = [
            pink.tasks.FrameTask(f, position_cost=1.0, orientation_cost=1.0, gain=GAIN)
            for f in case.frames
        ]
        posture = pink.tasks.PostureTask(cost=POSTURE_COST, gain=GAIN)
        posture.set_target(case.q)
        self.tasks = [*self.frames, posture]
        if case.com:
            com = pink.tasks.ComTask(cost=1.0, gain=GAIN)
            com.set_target_from_configuration(self.robot)
            self.tasks.append(com)
        self.limits = [
            pink.limits.ConfigurationLimit(model, config_limit_gain=LIMIT_GAIN),
            pink.limits.VelocityLimit(model),
        ]
        self.targets = [[pin.SE3(T) for T in tick] for tick in targets]
        self.q = case.q.copy()

    def tick(self, k: int, record: Record) -> None:
        t0 = clock()
        self.robot.update(self.q)
        t1 = clock()
        for task, target in zip(self.frames, self.targets[k], strict=True):
            task.set_target(target)
        problem = self.pink.build_ik(
            self.robot, self.tasks, DT, damping=DAMPING, limits=self.limits
        )
        t2 = clock()
        result = self.solve(problem, solver="daqp")
        t3 = clock()
        dq = found_step(result, self.robot.model.nv)
        self.q = self.robot.integrate(dq / DT, DT)
        t4 = clock()
        note(record, t0, t1, t2, t3, t4)
        record.q.append(self.q)
        record.v.append(dq / DT)
        record.failed += not result.found


class Mink:
    def __init__(self, case: Case, targets):
        import mink
        import qpsolvers

        self.mink, self.solve = mink, qpsolvers.solve_problem
        mj = case.description.to_mjspec().compile()
        self.conversion = Conversion(mj, case.model)
        self.robot = mink.Configuration(mj, self.conversion.q_to_mujoco(case.q))
        self.frames = [
            mink.FrameTask(
                f, "site", position_cost=1.0, orientation_cost=1.0, gain=GAIN
            )
            for f in case.frames
        ]
        posture = mink.PostureTask(mj, cost=POSTURE_COST, gain=GAIN)
        posture.set_target_from_configuration(self.robot)
        self.tasks = [*self.frames, posture]
        if case.com:
            com = mink.ComTask(cost=1.0, gain=GAIN)
            com.set_target_from_configuration(self.robot)
            self.tasks.append(com)
        joints = list(zip(case.model.names, case.model.joints, strict=True))[1:]
        speeds = {
            name: float(case.model.velocityLimit[j.idx_v])
            for name, j in joints
            if j.nv == 1
        }
        self.limits = [
            mink.ConfigurationLimit(mj, gain=LIMIT_GAIN),
            mink.VelocityLimit(mj, speeds),
        ]
        self.targets = [[mink.SE3.from_matrix(T) for T in tick] for tick in targets]
        self.q = self.robot.q.copy()

    def tick(self, k: int, record: Record) -> None:
        t0 = clock()
        self.robot.update(self.q)
        t1 = clock()
        for task, target in zip(self.frames, self.targets[k], strict=True):
            task.set_target(target)
        problem = self.mink.build_ik(
            self.robot, self.tasks, DT, damping=DAMPING, limits=self.limits
        )
        t2 = clock()
        result = self.solve(problem, solver="daqp")
        t3 = clock()
        dq = found_step(result, self.robot.nv)
        before, self.q = self.q, self.robot.integrate(dq / DT, DT)
        t4 = clock()
        note(record, t0, t1, t2, t3, t4)
        record.q.append(self.conversion.q_to_pinocchio(self.q))
        record.v.append(self.conversion.v_to_pinocchio(before, dq / DT))
        record.failed += not result.found


def found_step(result, nv: int) -> np.ndarray:
    """Return the solver's step, or none where it found none."""
    return np.zeros(nv) if result.x is None or not result.found else result.x


def note(record: Record, t0, t1, t2, t3, t4) -> None:
    """Book kinematics (update and integrate), rows, QP and total, us."""
    record.kinematics.append((t1 - t0 + t4 - t3) / 1e3)
    record.rows.append((t2 - t1) / 1e3)
    record.qp.append((t3 - t2) / 1e3)
    record.total.append((t4 - t0) / 1e3)


def placo_urdf(case: Case) -> str:
    """Return the robot as URDF, a planar root as three joints of one parameter."""
    text = case.description.to_urdf()
    planar = re.search(r'<joint name="root" type="planar">.*?</joint>', text, re.DOTALL)
    if planar is None:
        return text
    child = planar.group().partition('<child link="')[2].partition('"')[0]
    joints, parent = "", "world"
    axes = {"root_x": "1 0 0", "root_y": "0 1 0", "root_yaw": "0 0 1"}
    for k, (name, axis) in enumerate(axes.items()):
        link = child if name == "root_yaw" else f"{name}_link"
        joints += "" if link == child else f'<link name="{link}"/>'
        joints += (
            f'<joint name="{name}" type="{"revolute" if k == 2 else "prismatic"}">'
            f'<parent link="{parent}"/><child link="{link}"/><axis xyz="{axis}"/>'
            f'<limit lower="-100" upper="100" effort="1000"'
            f' velocity="{case.model.velocityLimit[k]}"/></joint>'
        )
        parent = link
    return text.replace(planar.group(), joints)


class Placo:
    """placo in its own environment, on the exported URDF; it takes turns too."""

    def __init__(self, case: Case, targets):
        python = Path(__file__).parent.parent / ".venv-placo" / "bin" / "python"
        python = Path(os.environ.get("PLACO_PYTHON", python))
        if not python.exists():
            raise ModuleNotFoundError(f"no {python}")
        self.case, self.kept = case, tempfile.TemporaryDirectory()
        self.folder = Path(self.kept.name)
        self.write(targets)
        script = Path(__file__).parent / "peers" / "placo_side.py"
        self.process = subprocess.Popen(
            [python, script, self.folder],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.wait_for("ready")

    def write(self, targets) -> None:
        case, names = self.case, list(self.case.model.names)[1:]
        (self.folder / "robot.urdf").write_text(placo_urdf(case))
        np.savez(self.folder / "in.npz", targets=targets, q=case.q)
        job = {
            "dt": DT,
            "frames": case.frames,
            "com": case.com,
            "free": case.root == "free",
            "joints": names[1:] if case.root == "free" else names,
            "posture_cost": POSTURE_COST,
            "damping": DAMPING,
        }
        (self.folder / "job.json").write_text(json.dumps(job))

    def wait_for(self, word: str) -> None:
        """Read on to an answer: placo prints words of its own."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.strip() == word:
                return
        raise RuntimeError("placo's process has ended")

    def run(self, ticks: int) -> None:
        assert self.process.stdin is not None
        print(ticks, file=self.process.stdin, flush=True)
        self.wait_for("done")

    def tick(self, k: int, record: Record) -> None:
        self.run(1)

    def finish(self, record: Record) -> None:
        """End the process; book its times (rows are inside its solve)."""
        self.process.communicate()
        out, case = np.load(self.folder / "out.npz"), self.case
        record.failed = int(out["failed"])
        record.kinematics, record.qp = list(out["kinematics"]), list(out["solve"])
        record.rows = [0.0] * len(record.qp)
        record.total, record.q = list(out["total"]), list(out["q"])
        before = [case.q, *record.q[:-1]]
        record.v = [
            pin.difference(case.model, a, b) / DT
            for a, b in zip(before, record.q, strict=True)
        ]
        self.kept.cleanup()


def run_case(case: Case, ticks: int) -> dict[str, Record]:
    """Run all sides, tick by tick in turns; then ours and placo in longer ones."""
    targets = case.targets(ticks)
    sides: dict[str, Any] = {
        "ours": Ours(case, targets),
        "ours, daqp": Ours(case, targets, warm=False),
    }
    for name, side in (("pink", Pink), ("mink", Mink), ("placo", Placo)):
        try:
            sides[name] = side(case, targets)
        except ModuleNotFoundError as error:
            print(f"  {name} is left out: {error}", file=sys.stderr)
    sides["ours, defaults"] = Ours(case, targets, defaults=True)
    records = {name: Record() for name in sides}
    names = list(sides)
    for k in range(ticks):
        for name in names[k % len(names) :] + names[: k % len(names)]:
            sides[name].tick(k, records[name])
    if "placo" in sides:
        sides["placo"].finish(records["placo"])
        run_alone(case, targets, records)
    return records


def run_alone(case: Case, targets, records: dict[str, Record]) -> None:
    """Run ours and placo in turns of many ticks, which leaves caches warm."""
    ours, placo = Ours(case, targets), Placo(case, targets)
    ours_alone = records["ours, alone"] = Record()
    placo_alone = records["placo, alone"] = Record()
    for first in range(0, len(targets), TURN):
        last = min(first + TURN, len(targets))
        for k in range(first, last):
            ours.tick(k, ours_alone)
        placo.run(last - first)
    placo.finish(placo_alone)


def quality(case: Case, record: Record, ticks: int) -> dict[str, float]:
    """Return tracking errors (mm) and the worst broken limits (rad, rad/s)."""
    robot, model, errors = Configuration(case.model), case.model, []
    targets = case.targets(ticks)
    for q, poses in list(zip(record.q, targets, strict=True))[::5]:
        robot.update(q)
        for frame, T in zip(case.hands, poses, strict=False):
            errors.append(
                np.linalg.norm(robot.frame_pose(frame).translation - T[:3, 3])
            )
    bounded = model.upperPositionLimit < 1e10
    q = np.array(record.q)[:, bounded]
    over = np.maximum(
        q - model.upperPositionLimit[bounded], model.lowerPositionLimit[bounded] - q
    )
    first = 6 if case.root == "free" else 0
    speed = np.abs(np.array(record.v))[:, first:] - model.velocityLimit[first:]
    return {
        "error_median_mm": 1e3 * float(np.median(errors)),
        "error_max_mm": 1e3 * float(np.max(errors)),
        "position_violation": max(0.0, float(over.max())),
        "velocity_violation": max(0.0, float(speed.max())),
    }


def add_case(
    case: Case, records: dict[str, Record], ticks: int, report: Report
) -> None:
    """Add rows and ratios of a case."""
    rows = {
        name: report.add(
            case.robot,
            name,
            record.total,
            kinematics_us=float(np.median(record.kinematics)),
            rows_us=float(np.median(record.rows)),
            qp_us=float(np.median(record.qp)),
            failed=record.failed,
            **quality(case, record, ticks),
        )
        for name, record in records.items()
    }
    ours = rows["ours"]
    for name in ("mink", "pink"):
        if name in rows:
            theirs, path = rows[name], f"{case.robot}/{name}"
            report.compare(path, ours, theirs)
            report.compare(f"{path}/daqp", rows["ours, daqp"], theirs)
            for key in ("error_median_mm", "error_max_mm"):
                ratio = ours[key] / theirs[key]
                report.ratios[f"{path}/{key[:-3].removesuffix('_median')}"] = ratio
    if "placo" in rows:
        path = f"{case.robot}/placo"
        report.compare(path, rows["ours, alone"], rows["placo, alone"])
        report.compare(f"{path}/turns", ours, rows["placo"])


COLUMNS = {
    "Time of a tick": ("median_us", "p99_us", "kinematics_us", "rows_us", "qp_us"),
    "How well it follows, and limits broken (rad, rad/s)": (
        "error_median_mm",
        "error_max_mm",
        "failed",
        "position_violation",
        "velocity_violation",
    ),
}


def main() -> None:
    parser = options(__doc__, "300 ticks")
    parser.add_argument("--ticks", type=int, default=5000)
    arguments = parser.parse_args()
    ticks = 300 if arguments.quick else arguments.ticks
    if hasattr(os, "sched_setaffinity"):  # one processor: peers' caches are no better
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    report = Report()
    for case in CASES:
        add_case(case, run_case(case, ticks), ticks, report)
    for title, columns in COLUMNS.items():
        report.show(title, ("case", "side", *columns))
    report.show_ratios()
    report.write(arguments.json)


if __name__ == "__main__":
    main()
