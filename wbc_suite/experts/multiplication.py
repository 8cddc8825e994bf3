"""Few demonstrations multiplied: their segments are moved to new scenes, and stitched.

Source: Mandlekar et al. (2023), "MimicGen: A Data Generation System for Scalable Robot
Learning using Human Demonstrations", CoRL. Other than there, a segment is chosen by a
look-ahead along all of it, the transition is spread over the way to the object, and an
object keeps its path however it lies in the hand.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.experts.arm import Arm
from wbc_suite.experts.demonstrations import (
    Demonstration,
    Segment,
    Track,
    read_demonstrations,
    shares_of_path,
    workcell,
)
from wbc_suite.experts.workcell import Steps, Workcell
from wbc_suite.typing import Vector

FAST, QUICK = 1.5, 4.0  # m/s, rad/s of goals
LAG, LAG_TURN = 0.06, 0.4  # m, rad; the next goal waits for a hand that lags so far
PATIENCE = 40  # control periods that it waits in a stage at most
CLOSING = 10  # control periods that another gripper may need more
ENDING = 10  # control periods after the last goal
SAMPLES = (0.4, 0.7, 0.85, 1.0)  # of the path of a segment, where it is looked at
COLLISION = 5.0  # s, cost of a grasp that is not clear
SPREAD = 0.3  # s, beside the best outlook, of which sources are drawn


class Multiplied:
    """A policy that solves a benchmark as demonstrations of it did; for one episode.

    Args:
        path: The recording.
        env: An environment of its benchmark that was reset; robots may be others.
        rng: Draws among sources.

    Attributes:
        finished: Whether the last goal was given; what comes then is no better.

    Raises:
        DatasetError: If the recording has no episode that can be used, or its hands
            are not as many as here.
    """

    def __init__(self, path: Path, env: RobotEnv, rng: np.random.Generator) -> None:
        demos = read_demonstrations(path, path.stat().st_mtime_ns)
        self._cell = workcell(env, rng)
        hands = len(demos[0].tracks)
        if len(self._cell.arms) != hands:
            raise DatasetError(
                f"'{path}' moves {hands} hands, and {env.benchmark.name} has "
                f"{len(self._cell.arms)} here."
            )
        self._steps = multiply(self._cell, demos)
        self.finished = False

    def __call__(self, observation: Mapping[str, Any]) -> Vector:
        """Return the next action; the observation is not used."""
        del observation
        try:
            next(self._steps)
        except StopIteration:
            self.finished = True
        return self._cell.action()


def multiply(cell: Workcell[Any], demos: Sequence[Demonstration]) -> Steps[None]:
    """Do what demonstrations did, each stage as the source that fits the scene best.

    Objects are taken in any order in which a demonstration takes them.
    """
    done: list[str] = []
    while names := _next_names(demos, done):
        found = [
            (demo, start, stop)
            for demo in demos
            for start, stop, name in demo.stages
            if name in names
        ]
        demo, start, stop = _choose(cell, found)
        if not (yield from _play(cell, demo, start, stop)):
            return
        done.append(next(name for first, _, name in demo.stages if first == start))
    for _ in range(ENDING):
        yield


def _next_names(demos: Sequence[Demonstration], done: Sequence[str]) -> set[str]:
    """Return the objects that come next in demonstrations that began with others."""
    orders = ([name for _, _, name in demo.stages] for demo in demos)
    k = len(done)
    return {o[k] for o in orders if len(o) > k and sorted(o[:k]) == sorted(done)}


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A segment in the present scene, from transform A of source poses to B.

    Attributes:
        B: Returns the transform at an action.
        grip: Returns what follows a pose of the source's hand, so that the object has
            its place.
    """

    segment: Segment
    A: pin.SE3
    B: Callable[[int], pin.SE3]
    grip: Callable[[], pin.SE3]

    def pose(self, source: pin.SE3, k: int) -> pin.SE3:
        """Return the pose for a pose of the source at action k."""
        A, B = self.A, self.B(k)
        w = float(self.segment.shares[k - self.segment.start])
        R = A.rotation @ pin.exp3(w * pin.log3(A.rotation.T @ B.rotation))
        a, b = A.act(source.translation), B.act(source.translation)
        return pin.SE3(R @ source.rotation, (1.0 - w) * a + w * b) * self.grip()


def _motion(
    cell: Workcell[Any],
    arm: Arm,
    demo: Demonstration,
    track: Track,
    segment: Segment,
    *,
    begun: bool = True,
) -> Motion:
    """Return the motion of a segment that begins now, or may come later."""
    at, name = segment.start, segment.name
    source = demo.objects[name]
    if not segment.held:
        A = arm.pose * track.hands[at].inverse()
        fixed = cell.pose(name) * source[at].inverse()

        def follow(k: int) -> pin.SE3:
            return cell.pose(name) * source[k].inverse() if begun else fixed

        return Motion(segment=segment, A=A, B=follow, grip=pin.SE3.Identity)
    A, B = cell.pose(name) * source[at].inverse(), pin.SE3.Identity()
    if segment.onto:
        B = cell.pose(segment.onto) * demo.objects[segment.onto][at].inverse()
    in_source = track.hands[at].actInv(source[at])
    last = [in_source.inverse()]

    def grip() -> pin.SE3:
        if begun and cell.holds(arm, name):
            last[0] = cell.pose(name).actInv(arm.pose)
        return in_source * last[0]

    return Motion(segment=segment, A=A, B=lambda _: B, grip=grip)


def _choose(
    cell: Workcell[Any], found: Sequence[tuple[Demonstration, int, int]]
) -> tuple[Demonstration, int, int]:
    """Draw one of the sources whose goals the hands follow about as well as any."""
    costs = np.array([_cost(cell, *each) for each in found])
    good = np.flatnonzero(costs <= costs.min() + SPREAD)
    return found[int(cell.rng.choice(good))]


def _cost(cell: Workcell[Any], demo: Demonstration, start: int, stop: int) -> float:
    """Return the cost of the outlooks of all hands along a stage."""
    total = 0.0
    for arm, track in zip(cell.arms, demo.tracks, strict=True):
        poses: list[pin.SE3] = []
        near: list[tuple[int, str]] = []
        for segment in track.segments:
            if not start <= segment.start < stop:
                continue
            motion = _motion(cell, arm, demo, track, segment, begun=False)
            if not segment.held and not near:
                near = [(len(poses) + k, segment.name) for k in range(1, len(SAMPLES))]
            goals = track.goals[segment.start : segment.stop]
            for k in np.searchsorted(shares_of_path(goals), SAMPLES):
                poses.append(motion.pose(goals[k], segment.start + k))
        outlook = arm.look_ahead(poses)
        total += outlook.cost
        for k, name in near:
            q = arm.configuration(outlook.q[k])
            total += COLLISION * (not cell.is_clear(arm, q, but=name))
    return total


def _play(
    cell: Workcell[Any], demo: Demonstration, start: int, stop: int
) -> Steps[bool]:
    """Give the goals of a stage; return whether each object was held where it was."""
    motions: dict[Arm, Motion] = {}
    patience = PATIENCE
    for k in range(start, stop):
        for arm, track in zip(cell.arms, demo.tracks, strict=True):
            segment = next((s for s in track.segments if s.start <= k < s.stop), None)
            if segment is None:  # a hand that holds nothing
                continue
            if arm not in motions or motions[arm].segment is not segment:
                if segment.held and not (yield from _held(cell, arm, segment.name)):
                    return False
                motions[arm] = _motion(cell, arm, demo, track, segment)
            goal = motions[arm].pose(track.goals[k], k)
            arm.aim(goal, speed=FAST, turn=QUICK, exact=False)
            (arm.close if track.closes[k] else arm.open)()
        yield
        while patience and any(_lags(arm) for arm in motions):
            patience -= 1
            yield
    return True


def _lags(arm: Arm) -> bool:
    far, turn = arm.error()
    return far > LAG or turn > LAG_TURN


def _held(cell: Workcell[Any], arm: Arm, name: str) -> Steps[bool]:
    """Wait until fingers hold an object, as long as another hand may need."""
    for _ in range(CLOSING):
        if cell.holds(arm, name):
            return True
        yield
    return cell.holds(arm, name)
