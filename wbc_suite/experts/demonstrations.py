"""Demonstrations in segments: hands reach for an object, or carry it.

A segment begins and ends where two fingers begin and cease to touch an object.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark import ObjectBenchmark
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.experts.scene import ExpertScene
from wbc_suite.recording import Dataset, Episode, rebuild
from wbc_suite.recording.replaying import start_as
from wbc_suite.typing import Vector

BRIEF = 3  # actions; shorter contacts and interruptions do not count
WITHDRAWAL = 8  # actions after a release, which still belong to the object
STRAIGHT_UP = 0.05  # m; objects that are moved aside by less go nowhere
BLENDED = 0.6  # of the way to an object; its rest is relative to the object alone
CARRIED = 0.9  # of the way of an object; likewise for where it is put


@dataclass(frozen=True, kw_only=True, slots=True)
class Segment:
    """Actions `start` to `stop` of a hand.

    Attributes:
        name: The object that the hand reaches for, or holds.
        held: Whether it holds the object.
        onto: The object that it is put on; "" for what does not move.
        shares: Of the way, from 0 to 1, at each action.
    """

    start: int
    stop: int
    name: str
    held: bool
    onto: str
    shares: Vector


@dataclass(frozen=True, kw_only=True, slots=True)
class Track:
    """What one hand did; poses T_wh of the frame of its grasp before each action."""

    hands: Sequence[pin.SE3]
    goals: Sequence[pin.SE3]
    closes: Sequence[bool]
    segments: Sequence[Segment]


@dataclass(frozen=True, kw_only=True, slots=True)
class Demonstration:
    """A track for each hand, and the poses T_wo of objects before each action."""

    tracks: Sequence[Track]
    objects: Mapping[str, Sequence[pin.SE3]]

    @property
    def length(self) -> int:
        """Number of actions."""
        return len(self.tracks[0].goals)

    @property
    def stages(self) -> list[tuple[int, int, str]]:
        """First action, end and object of what can be taken from different sources.

        With one hand each object is a stage; with several all is one.
        """
        segments = self.tracks[0].segments
        if len(self.tracks) > 1:
            return [(0, self.length, "")]
        pairs = zip(segments[::2], segments[1::2], strict=True)
        return [(pair[0].start, pair[-1].stop, pair[0].name) for pair in pairs]


@lru_cache(maxsize=4)
def read_demonstrations(path: Path, written: int) -> tuple[Demonstration, ...]:
    """Repeat the successful episodes of a recording, and divide them into segments.

    `written` is the time of the file's last change, as a key of the cache.

    Raises:
        DatasetError: If no successful episode holds an object.
    """
    del written
    found = []
    with Dataset(path) as dataset:
        env = rebuild(dataset)
        try:
            for name in dataset.names:
                if dataset.facts(name).get("success", True):
                    found.append(_read(env, dataset.episode(name)))
        finally:
            env.close()
    useful = [each for each in found if any(t.segments for t in each.tracks)]
    if not useful:
        raise DatasetError(
            f"'{path}': in none of {len(found)} successful episodes do fingers hold "
            "an object, so they cannot be divided into segments."
        )
    return tuple(useful)


def expert_scene(env: RobotEnv, rng: np.random.Generator) -> ExpertScene[Any]:
    """Return the scene of an environment, or raise DatasetError without objects."""
    if not isinstance(env.benchmark, ObjectBenchmark):
        raise DatasetError(f"{env.benchmark.name} has no objects to grasp.")
    return ExpertScene(env, env.benchmark, rng)


def _read(env: RobotEnv, episode: Episode) -> Demonstration:
    """Take the actions of an episode again, and note hands, goals and objects."""
    start_as(env, episode)
    scene = expert_scene(env, np.random.default_rng(0))
    names = [name for name, sites in scene.benchmark.grasps.items() if sites]
    objects: dict[str, list[pin.SE3]] = {name: [] for name in names}
    rows: list[list[tuple[pin.SE3, pin.SE3, bool]]] = [[] for _ in scene.arms]
    holds: list[list[str]] = [[] for _ in scene.arms]
    under: list[dict[str, str]] = []
    for action in episode.columns["actions"]:
        for name in names:
            objects[name].append(scene.pose(name))
        for arm, row, held in zip(scene.arms, rows, holds, strict=True):
            row.append((arm.pose, *arm.read(action)))
            held.append(next((n for n in names if scene.holds(arm, n)), ""))
        under.append(dict(_supports(scene, names)))
        env.advance(action)
    under.append(dict(_supports(scene, names)))  # an object may have just been released
    tracks = [
        _track(scene, row, held, objects, under)
        for row, held in zip(rows, holds, strict=True)
    ]
    return Demonstration(tracks=tracks, objects=objects)


def _supports(
    scene: ExpertScene[Any], names: Sequence[str]
) -> Iterator[tuple[str, str]]:
    """Yield objects that touch a lower one that can move, and this one."""
    states = scene.benchmark.states
    free = [name for name in names if name in states and states[name].is_free]
    for one, other in itertools.permutations(free, 2):
        lower = scene.object(other).position[2] < scene.object(one).position[2]
        if lower and scene.touching(one, other):
            yield one, other


def _track(
    scene: ExpertScene[Any],
    row: Sequence[tuple[pin.SE3, pin.SE3, bool]],
    holds: list[str],
    objects: Mapping[str, Sequence[pin.SE3]],
    under: Sequence[Mapping[str, str]],
) -> Track:
    hands, goals, closes = zip(*row, strict=True)
    segments: list[Segment] = []
    runs = list(_runs(holds))
    for k, (begin, end, name) in enumerate(runs):
        last = k + 1 == len(runs)
        stop = len(holds) if last else min(end + WITHDRAWAL, runs[k + 1][0] - 1)
        path = np.array([pose.translation for pose in objects[name][begin:end]])
        states = scene.benchmark.states
        moves = name in states and states[name].is_free
        onto = next((u[name] for u in under[end - 1 : stop + 1] if name in u), "")
        least = 0.0 if onto else STRAIGHT_UP
        carried = _shares(path[:, :2], CARRIED, least=least)
        start = segments[-1].stop if segments else 0
        approach = np.array([pose.translation for pose in hands[start:begin]])
        segments += [
            Segment(
                start=start,
                stop=begin,
                name=name,
                held=False,
                onto="",
                shares=_shares(approach, BLENDED),
            ),
            Segment(
                start=begin,
                stop=stop,
                name=name,
                held=True,
                onto=onto,
                shares=np.append(
                    carried * moves, np.full(stop - end, carried[-1] * moves)
                ),
            ),
        ]
    return Track(hands=hands, goals=goals, closes=closes, segments=segments)


def _runs(holds: list[str]) -> Iterator[tuple[int, int, str]]:
    """Yield begin, end and object of each time that one is held."""
    smooth = list(holds)
    for name in {*holds} - {""}:
        for begin, end, held in _groups([each == name for each in holds]):
            inside = begin > 0 and end < len(holds)
            if not held and inside and end - begin < BRIEF:
                smooth[begin:end] = [name] * (end - begin)
    for begin, end, name in _groups(smooth):
        if name and end - begin >= BRIEF:
            yield begin, end, name


def _groups(values: Sequence[Any]) -> Iterator[tuple[int, int, Any]]:
    """Yield begin, end and value of runs of equal values."""
    begin = 0
    for value, run in itertools.groupby(values):
        end = begin + len(list(run))
        yield begin, end, value
        begin = end


def _shares(path: Vector, complete: float, *, least: float = 0.0) -> Vector:
    """Return the share of a path that lies behind each of its points, up to 1.

    It is 1 once a part `complete` of its length is behind; 0 if the ends of the path
    are nearer to each other than `least`, m.
    """
    if len(path) < 2 or np.linalg.norm(path[-1] - path[0]) < least:
        return np.zeros(len(path))
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    behind = np.append(0.0, np.cumsum(lengths))
    return np.minimum(behind / max(complete * behind[-1], 1e-9), 1.0)


def shares_of_path(poses: Sequence[pin.SE3]) -> Vector:
    """Return the share of a path that lies behind each of its poses; it ends with 1."""
    return _shares(np.array([pose.translation for pose in poses]), 1.0)
