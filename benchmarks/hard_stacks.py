"""Infeasible QP stacks: does the robot come to rest, and how soon?

Each seed makes a stack of one, two or three levels for GR1, SpotWithArm, Tiago or
Panda, of one of the families in `FAMILIES`. Its targets rest from the start, for 20 s
of 100 ticks a second; the QP's step is the robot's motion. In the second half no joint
speed may change by more than 0.01 rad/s (m/s for a sliding joint) between two ticks,
unless `Solution.motion` says why. Times of a tick are CPU times of the thread.

Usage: python benchmarks/hard_stacks.py [--quick] [--json FILE] [--stacks N]
           [--first SEED] [--seconds S] [--solver NAME ...] [--verbose]
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import chain
from typing import Literal

from harness.report import Report, options

import numpy as np  # isort: skip  (after harness: it sets the number of threads)
import pinocchio as pin

import wbc_suite
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    ComTask,
    Equality,
    FrameEquality,
    FrameTask,
    LinearEquality,
    PostureTask,
    SelfCollisionLimit,
    Task,
    TaskStack,
)

DT = 0.01  # s
SECONDS = 20.0
AT_REST = 0.01  # rad/s or m/s, greatest change of a speed between two ticks
SOLVERS = ("daqp", "proxqp", "osqp", "quadprog", "piqp", "clarabel")
FAMILIES = ("conflicting", "unreachable", "dependent", "singular", "equality")
KINDS = ("Relaxed", "Escaping", "Overshoot", "Approach")
"""Of what `Solution.motion` names, weightiest first."""
FEET = ("right_foot", "left_foot")
PAWS = tuple(
    f"{end}_{side}_foot" for end in ("front", "rear") for side in ("left", "right")
)


@dataclass(frozen=True, kw_only=True)
class Robot:
    """A robot with the frames that are given targets, and those that stand."""

    name: str
    root: Literal["fixed", "planar", "free"] | None = None
    frames: tuple[str, ...]
    feet: tuple[str, ...] = ()


ROBOTS = (
    Robot(
        name="GR1",
        root="free",
        frames=("right_eef", "left_eef", "head", "torso", "right_tcp"),
        feet=FEET,
    ),
    Robot(name="GR1", root="fixed", frames=("right_eef", "left_eef", *FEET, "head")),
    Robot(name="SpotWithArm", frames=("right_eef", "right_tcp", "base"), feet=PAWS),
    Robot(name="Tiago", frames=("right_eef", "left_eef", "head", "left_tcp")),
    Robot(name="Panda", frames=("right_eef", "right_tcp")),
)


@cache
def _model(robot: Robot) -> tuple[wbc_suite.robot.RobotDescription, pin.Model]:
    description = wbc_suite.load_robot(robot.name, root=robot.root)
    return description, description.to_pinocchio()


class HardStack:
    """One stack, made of a seed."""

    def __init__(self, seed: int, solver: str = "daqp") -> None:
        count = len(ROBOTS)
        self.robot, family = ROBOTS[seed % count], FAMILIES[seed // count % 5]
        self.family, self.seed = family, seed
        self.level_count = 1 + seed // (5 * count) % 3
        self.rng = np.random.default_rng(seed)
        self.description, self.model = _model(self.robot)
        self.configuration = Configuration(self.model, self._start())
        tasks, equalities = getattr(self, f"_{family}")()
        if self.rng.random() < 0.8:
            tasks.append(PostureTask(1e-2, level=self._level()))
        if self.robot.feet and family != "equality" and self.rng.random() < 0.8:
            equalities += [FrameEquality(foot) for foot in self.robot.feet]
            tasks.append(ComTask(level=self._level()))
        limits = []
        if self.rng.random() < 0.3:
            limits.append(SelfCollisionLimit.of_robot(self.description, nearest=10))
        self.stack = TaskStack(
            self.configuration,
            tasks,
            limits=limits,
            equalities=equalities,
            solver=solver,
        )

    @property
    def name(self) -> str:
        root = f" {self.robot.root}" if self.robot.root else ""
        return f"{self.seed} {self.robot.name}{root} {self.family} {self.level_count}"

    def _start(self) -> np.ndarray:
        """Return the keyframe, disturbed; stretched limbs for the singular family."""
        q = pin.neutral(self.model)
        if self.family != "singular":
            for joint, value in self.description.keyframes["ready"].items():
                q[self.model.joints[self.model.getJointId(joint)].idx_q] = value
        bounded = self.model.upperPositionLimit < 1e10
        if self.family != "singular":
            q[bounded] += self.rng.uniform(-0.3, 0.3, int(bounded.sum()))
        lower, upper = self.model.lowerPositionLimit, self.model.upperPositionLimit
        q[bounded] = np.clip(q, lower, upper)[bounded]
        return q

    def _level(self) -> int:
        return int(self.rng.integers(self.level_count))

    def _frame(self) -> str:
        return str(self.rng.choice(self.robot.frames))

    def _moved(self, frame: str, distance: float, angle: float) -> pin.SE3:
        """Return a frame's pose moved and turned in a random direction."""
        direction, axis = (v / np.linalg.norm(v) for v in self.rng.normal(size=(2, 3)))
        pose = self.configuration.frame_pose(frame)
        return pin.SE3(
            pin.exp3(angle * axis) @ pose.rotation,
            pose.translation + distance * direction,
        )

    def _task(self, frame: str, target: pin.SE3, level: int, name: str) -> FrameTask:
        rng = self.rng
        return FrameTask(
            frame,
            target=target,
            position_cost=10.0 ** rng.uniform(-1, 1),
            orientation_cost=float(rng.choice([0.0, 0.1, 1.0])),
            gain=float(rng.choice([0.5, 1.0])),
            level=level,
            name=name,
        )

    def _random_tasks(self, count: int, least: float, most: float) -> list[Task]:
        """Return tasks with targets that far away; each level has one at least."""
        found: list[Task] = []
        for k in range(max(count, self.level_count)):
            frame = self._frame()
            distance, angle = self.rng.uniform(least, most), self.rng.uniform(0, 3)
            level = k if k < self.level_count else self._level()
            target = self._moved(frame, distance, angle)
            found.append(self._task(frame, target, level, f"{k} {frame}"))
        return found

    def _conflicting(self) -> tuple[list[Task], list[Equality]]:
        """Some frames, each with two targets."""
        tasks = self._random_tasks(1 + int(self.rng.integers(2)), 0.05, 0.6)
        for task in list(tasks):
            assert isinstance(task, FrameTask)
            target = self._moved(task.frame, self.rng.uniform(0.05, 0.6), 1.0)
            other = self._task(task.frame, target, self._level(), f"{task.name} too")
            tasks.append(other)
        return tasks, []

    def _unreachable(self) -> tuple[list[Task], list[Equality]]:
        """Targets metres away."""
        return self._random_tasks(1 + int(self.rng.integers(3)), 1.0, 5.0), []

    def _dependent(self) -> tuple[list[Task], list[Equality]]:
        """The same rows twice or nearly, as tasks, equalities and across levels."""
        tasks = self._random_tasks(1, 0.0, 0.5)
        for task in list(tasks):
            assert isinstance(task, FrameTask)
            target, noise = task.target, 10.0 ** self.rng.uniform(-9, -2)
            target.translation = target.translation + noise * self.rng.normal(size=3)
            again = self._task(task.frame, target, self._level(), f"{task.name} again")
            tasks.append(again)
        frame, noise = self._frame(), 10.0 ** self.rng.uniform(-9, -3)
        rows = self.rng.normal(size=(2, self.model.nv))
        rows = np.concatenate([rows, rows + noise * self.rng.normal(size=rows.shape)])
        equalities: list[Equality] = [LinearEquality(rows)]
        equalities += [FrameEquality(frame, name=f"{frame} {k}") for k in range(2)]
        return tasks, equalities if self.rng.random() < 0.5 else []

    def _singular(self) -> tuple[list[Task], list[Equality]]:
        """Stretched limbs, drawn in or out along themselves, by little or far."""
        tasks: list[Task] = []
        for k in range(max(self.level_count, 2)):
            frame = self.robot.frames[k % len(self.robot.frames)]
            pose = self.configuration.frame_pose(frame)
            hand = self.model.frames[self.model.getFrameId(frame)].parentJoint
            limb = list(self.model.supports[hand])
            shoulder = self.configuration.joint_poses[limb[len(limb) // 2], 9:]
            along = pose.translation - shoulder
            along /= max(float(np.linalg.norm(along)), 1e-3)
            far = self.rng.choice([-1.0, 1.0]) * 10.0 ** self.rng.uniform(-3, 0)
            target = pin.SE3(pose.rotation, pose.translation + far * along)
            level = k % self.level_count
            tasks.append(self._task(frame, target, level, f"{k} {frame}"))
        return tasks, []

    def _equality(self) -> tuple[list[Task], list[Equality]]:
        """Rows that no step keeps: frames out of reach, and rates for ever."""
        rng, equalities = self.rng, list[Equality]()
        frames = rng.permutation([*self.robot.frames, *self.robot.feet])
        for frame in frames[: int(rng.integers(1, 3))].tolist():
            target = self._moved(frame, rng.uniform(0.2, 3.0), rng.uniform(0, 2))
            equalities.append(FrameEquality(frame, target=target))
        if rng.random() < 0.4:
            row = np.zeros((1, self.model.nv))
            row[0, int(rng.integers(self.model.nv))] = 1.0
            rate = np.array([rng.uniform(-5.0, 5.0)])
            equalities.append(LinearEquality(row, rate=rate, name="go"))
            if rng.random() < 0.5:
                equalities.append(LinearEquality(row, name="stand"))
        return self._random_tasks(1, 0.0, 1.0), equalities


@dataclass(frozen=True, kw_only=True)
class Run:
    """What one stack did."""

    change: float  # rad/s, greatest change of a speed between two ticks at rest
    unsaid: float  # the same, of ticks whose solution says nothing
    said: dict[str, float]  # the same, by what their solutions name
    times: np.ndarray  # us, of each tick


def run(hard: HardStack, seconds: float = SECONDS) -> Run:
    """Tick a stack; rest is the second half."""
    stack, robot, count = hard.stack, hard.configuration, round(seconds / DT)
    times, before = np.zeros(count), stack.v_previous.copy()
    change, unsaid, said = 0.0, 0.0, dict[str, float]()
    for k in range(count):
        start = time.thread_time_ns()
        solution = stack.solve(DT)
        times[k] = (time.thread_time_ns() - start) / 1e3
        robot.update(robot.integrate(solution.dq))
        if k >= count // 2:
            now = float(np.abs(solution.v - before).max())
            change = max(change, now)
            if now > AT_REST:
                motion = solution.motion
                unsaid = max(unsaid, 0.0 if motion else now)
                for name in {type(reason).__name__ for reason in motion}:
                    said[name] = max(said.get(name, 0.0), now)
        before = solution.v
    return Run(change=change, unsaid=unsaid, said=said, times=times)


def main() -> None:
    parser = options(__doc__, "25 stacks of 4 s")
    parser.add_argument("--stacks", type=int, default=500)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--solver", nargs="+", default=["daqp"], choices=SOLVERS)
    parser.add_argument("--verbose", action="store_true", help="a line per stack")
    arguments = parser.parse_args()
    report = Report()
    stacks, seconds = arguments.stacks, arguments.seconds
    if arguments.quick:
        stacks, seconds = 25, 4.0
    for solver in arguments.solver:
        seeds = range(arguments.first, arguments.first + stacks)
        _measure(report, solver, seeds, seconds, verbose=arguments.verbose)
    columns = (
        "case side median_us p99_us p999_us worst_us n stacks change unsaid silent"
    )
    report.show("Hard stacks", (*columns.split(), *(kind.lower() for kind in KINDS)))
    report.write(arguments.json)


def _measure(
    report: Report, solver: str, seeds: Sequence[int], seconds: float, *, verbose: bool
) -> None:
    """Run stacks with one solver; add a row for each family."""
    runs: dict[str, list[Run]] = {}
    for seed in range(5 * len(ROBOTS)):  # compiles
        run(HardStack(seed, solver), 1.0)
    for seed in seeds:
        hard = HardStack(seed, solver)
        found = run(hard, seconds)
        runs.setdefault(hard.family, []).append(found)
        if verbose:
            print(
                f"{hard.name:40} {found.change:9.4f} {found.unsaid:9.4f} "
                f"p99.9 {np.percentile(found.times, 99.9):7.0f} "
                f"worst {found.times.max():7.0f} us  {found.said}",
                flush=True,
            )
    for family, own in {**runs, "all": [*chain(*runs.values())]}.items():
        times = np.concatenate([x.times for x in own])
        report.add(
            family,
            solver,
            times,
            p999_us=float(np.percentile(times, 99.9)),
            worst_us=float(times.max()),
            stacks=len(own),
            change=max(x.change for x in own),
            unsaid=max(x.unsaid for x in own),
            silent=sum(x.unsaid > AT_REST for x in own),
            **{kind.lower(): sum(kind in x.said for x in own) for kind in KINDS},
        )


if __name__ == "__main__":
    main()
