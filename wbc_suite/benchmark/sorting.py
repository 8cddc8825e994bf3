"""Rules of benchmarks in which each object belongs to a place of its own."""

import math
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from wbc_suite.benchmark.staged_reward import StagedReward
from wbc_suite.scene.objects import ObjectState
from wbc_suite.sensing.reading import Reading, computed, selected


class SortingBenchmark(Protocol):
    """What the rules need of a benchmark; most of it is in `ObjectBenchmark`."""

    states: dict[str, ObjectState]

    def goal(self, name: str) -> tuple[float, float]:
        """Return the place of an object, x y in m."""
        ...

    def is_over(self, name: str) -> bool:
        """Whether an object is at its place, or above it."""
        ...

    def lies(self, name: str) -> bool:
        """Whether an object lies at its place."""
        ...

    def nearest_hand(self, name: str) -> float:
        """Return the distance of the nearest hand to an object, m."""
        ...

    def grasped(self, name: str) -> bool:
        """Whether a hand grasps an object."""
        ...

    def hand_poses_of(self, names: Mapping[str, str]) -> dict[str, Reading]:
        """Return poses of objects by label; see `ObjectBenchmark`."""
        ...


class Sorting:
    """Draws the objects of an episode, and rewards those at their places.

    Args:
        benchmark: The benchmark.
        names: Its objects.
        pick_one: Whether each episode has one of them, drawn at reset.
        stages: Staged reward of each object.
        lifted: Height to which lifting is rewarded, m.

    Attributes:
        active: The objects of this episode.
        number: Index of the object of this episode, with `pick_one`.
    """

    def __init__(
        self,
        benchmark: SortingBenchmark,
        names: Sequence[str],
        *,
        pick_one: bool,
        stages: StagedReward,
        lifted: float,
    ) -> None:
        self._benchmark, self._names, self._pick_one = benchmark, tuple(names), pick_one
        self._stages, self._lifted = stages, lifted
        self.active, self.number = self._names, 0

    def draw(self, rng: np.random.Generator) -> list[str]:
        """Draw the objects of an episode; return those that are not used."""
        if self._pick_one:
            self.number = int(rng.integers(len(self._names)))
            self.active = (self._names[self.number],)
        return [name for name in self._names if name not in self.active]

    def observables(self) -> dict[str, Reading]:
        """Return poses in the world and in the frames of the hands, x y z w.

        With `pick_one` the object of the episode is called `obj`, and `obj_id` is its
        index.
        """
        poses_of = self._benchmark.hand_poses_of
        if not self._pick_one:
            return poses_of({name: name for name in self._names})
        each = [poses_of({"obj": name}) for name in self._names]
        readings = {
            key: selected([poses[key] for poses in each], lambda: self.number)
            for key in each[0]
        }
        return readings | {"obj_id": computed(1, lambda: self.number)}

    def is_placed(self, name: str) -> bool:
        """Whether an object lies at its place, and no hand is near or grasps it."""
        benchmark = self._benchmark
        return (
            benchmark.lies(name)
            and self._stages.has_left(benchmark.nearest_hand(name))
            and not benchmark.grasped(name)
        )

    def success(self) -> bool:
        """Whether each object is at its place."""
        return all(self.is_placed(name) for name in self.active)

    def progress(self) -> float:
        """Return the shaped reward.

        1 for each object at its place, and the largest staged reward of the others;
        divided by the number of objects.
        """
        left = [name for name in self.active if not self.is_placed(name)]
        best = max((self._staged(name) for name in left), default=0.0)
        return (len(self.active) - len(left) + best) / len(self.active)

    def _staged(self, name: str) -> float:
        benchmark = self._benchmark
        x, y, z = benchmark.states[name].position.tolist()
        return self._stages.value(
            distance=benchmark.nearest_hand(name),
            grasped=benchmark.grasped(name),
            missing=max(self._lifted - z, 0.0),
            aside=math.dist((x, y), benchmark.goal(name)),
            over=benchmark.is_over(name),
        )
