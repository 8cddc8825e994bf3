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
    expert_scene,
    read_demonstrations,
    shares_of_path,
)
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.typing import Vector

QUARTER = np.array([0.0, 0.0, np.pi / 2])  # rad
FAST, QUICK = 1.5, 4.0  # m/s, rad/s of goals
LAG, LAG_TURN = 0.01, 0.1  # m, rad; a goal waits for hands that lag so much more
PATIENCE = 40  # control periods that it waits in a stage at most
CLOSING = 10  # control periods that another gripper may need more
ENDING = 10  # control periods after the last goal
SAMPLES = (0.4, 0.7, 0.85, 1.0)  # of the path of a segment, where it is looked at
COLLISION = 5.0  # s, cost of a grasp that is not clear
TOUCH = 1e-3  # m; what overlaps less is clear
SPREAD = 0.3  # s, beside the best prediction, of which sources are drawn


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
        self._scene = expert_scene(env, rng)
        hands = len(demos[0].tracks)
        if len(self._scene.arms) != hands:
            raise DatasetError(
                f"'{path}' was recorded with {hands} hand(s), but this environment has "
                f"{len(self._scene.arms)}."
            )
        self._steps = multiply(self._scene, demos)
        self.finished = False

    def __call__(self, observation: Mapping[str, Any]) -> Vector:
        """Return the next action; the observation is not used."""
        del observation
        try:
            next(self._steps)
        except StopIteration:
            self.finished = True
        return self._scene.action()


@dataclass(frozen=True, kw_only=True)
class Source:
    """A stage of a demonstration, see `Demonstration.stages`.

    Attributes:
        turn: Turn of the object in its frame that makes no difference.
    """

    demo: Demonstration
    start: int
    stop: int
    name: str
    turn: pin.SE3


def multiply(scene: ExpertScene[Any], demos: Sequence[Demonstration]) -> Steps[None]:
    """Do what demonstrations did, each stage as the source that fits the scene best.

    Objects are taken in any order in which a demonstration takes them.
    """
    done: list[str] = []
    while names := _next_names(demos, done):
        found = [
            Source(demo=demo, start=start, stop=stop, name=name, turn=turn)
            for demo in demos
            for start, stop, name in demo.stages
            if name in names
            for turn in _symmetries(scene, name)
        ]
        source = _choose(scene, found)
        if not (yield from _play(scene, source)):
            return
        done.append(source.name)
    for _ in range(ENDING):
        yield


def _next_names(demos: Sequence[Demonstration], done: Sequence[str]) -> set[str]:
    """Return the objects that come next in demonstrations that began with others."""
    orders = ([name for _, _, name in demo.stages] for demo in demos)
    k = len(done)
    return {o[k] for o in orders if len(o) > k and sorted(o[:k]) == sorted(done)}


def _symmetries(scene: ExpertScene[Any], name: str) -> list[pin.SE3]:
    """Return quarter turns about an object's z axis that keep its grasp sites."""
    sites = [site.pose for site in scene.grasps(name)] if name else []
    turns = [pin.SE3(pin.exp3(k * QUARTER), np.zeros(3)) for k in range(4)]

    def is_site(pose: pin.SE3) -> bool:
        return any(pose.isApprox(site, 1e-6) for site in sites)

    if not sites:
        return turns[:1]
    return [turn for turn in turns if all(is_site(turn * site) for site in sites)]


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
    scene: ExpertScene[Any],
    arm: Arm,
    track: Track,
    segment: Segment,
    source: Source,
    *,
    begun: bool = True,
) -> Motion:
    """Return the motion of a segment that begins now, or may come later."""
    at, objects = segment.start, source.demo.objects
    recorded = objects[segment.name]

    def pose() -> pin.SE3:
        return scene.pose(segment.name) * source.turn

    if not segment.held:
        A = arm.pose * track.hands[at].inverse()
        fixed = pose() * recorded[at].inverse()

        def follow(k: int) -> pin.SE3:
            return pose() * recorded[k].inverse() if begun else fixed

        return Motion(segment=segment, A=A, B=follow, grip=pin.SE3.Identity)
    A, B = pose() * recorded[at].inverse(), pin.SE3.Identity()
    if segment.onto:
        lower, before = scene.pose(segment.onto), objects[segment.onto][at].inverse()
        turns = _symmetries(scene, segment.onto)
        ways = [lower * turn * before for turn in turns]
        B = min(
            ways, key=lambda way: np.linalg.norm(pin.log3((A.inverse() * way).rotation))
        )
    in_source = track.hands[at].actInv(recorded[at])
    last = [in_source.inverse()]

    def grip() -> pin.SE3:
        if begun and scene.holds(arm, segment.name):
            last[0] = pose().actInv(arm.pose)
        return in_source * last[0]

    return Motion(segment=segment, A=A, B=lambda _: B, grip=grip)


def _choose(scene: ExpertScene[Any], found: Sequence[Source]) -> Source:
    """Draw one of the sources whose goals the hands follow about as well as any."""
    costs = np.array([_cost(scene, each) for each in found])
    good = np.flatnonzero(costs <= costs.min() + SPREAD)
    return found[int(scene.rng.choice(good))]


def _cost(scene: ExpertScene[Any], source: Source) -> float:
    """Return the cost of the predictions of all hands along a stage."""
    total = 0.0
    for arm, track in zip(scene.arms, source.demo.tracks, strict=True):
        poses: list[pin.SE3] = []
        near: list[tuple[int, str]] = []
        for segment in track.segments:
            if not source.start <= segment.start < source.stop:
                continue
            motion = _motion(scene, arm, track, segment, source, begun=False)
            if not segment.held and not near:
                near = [(len(poses) + k, segment.name) for k in range(1, len(SAMPLES))]
            goals = track.goals[segment.start : segment.stop]
            for k in np.searchsorted(shares_of_path(goals), SAMPLES):
                poses.append(motion.pose(goals[k], segment.start + k))
        prediction = arm.look_ahead(poses)
        total += prediction.cost
        for k, name in near:
            q = arm.configuration(prediction.q[k])
            total += COLLISION * (scene.overlap(arm, q, but=name) > TOUCH)
    return total


def _play(scene: ExpertScene[Any], source: Source) -> Steps[bool]:
    """Give the goals of a stage; return whether each object was held where it was."""
    motions: dict[Arm, Motion] = {}
    patience = PATIENCE
    for k in range(source.start, source.stop):
        for arm, track in zip(scene.arms, source.demo.tracks, strict=True):
            segment = next((s for s in track.segments if s.start <= k < s.stop), None)
            if segment is None:  # a hand that holds nothing
                continue
            if arm not in motions or motions[arm].segment is not segment:
                if segment.held and not (yield from _held(scene, arm, segment.name)):
                    return False
                motions[arm] = _motion(scene, arm, track, segment, source)
            goal = motions[arm].pose(track.goals[k], k)
            arm.aim(goal, speed=FAST, turn=QUICK, exact=False)
            (arm.close if track.closes[k] else arm.open)()
        yield
        while patience and any(
            _lags(arm, track, k)
            for arm, track in zip(scene.arms, source.demo.tracks, strict=True)
            if arm in motions
        ):
            patience -= 1
            yield
    return True


def _lags(arm: Arm, track: Track, k: int) -> bool:
    """Whether a hand is farther from its goal than the source's was after action k."""
    error = track.hands[min(k + 1, len(track.hands) - 1)].actInv(track.goals[k])
    far, turn = arm.error()
    far -= float(np.linalg.norm(error.translation))
    turn -= float(np.linalg.norm(pin.log3(error.rotation)))
    return far > LAG or turn > LAG_TURN


def _held(scene: ExpertScene[Any], arm: Arm, name: str) -> Steps[bool]:
    """Wait until fingers hold an object, as long as another hand may need."""
    for _ in range(CLOSING):
        if scene.holds(arm, name):
            return True
        yield
    return scene.holds(arm, name)
