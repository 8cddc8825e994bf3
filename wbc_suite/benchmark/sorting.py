"""Rules of benchmarks in which each object belongs to a place of its own."""

import math
from collections.abc import Callable, Mapping

import numpy as np

from wbc_suite.benchmark.object_benchmark import ObjectBenchmark
from wbc_suite.benchmark.staged_reward import StagedReward
from wbc_suite.sensing.reading import Reading, computed, selected
from wbc_suite.typing import Vector


class Sorting:
    """Draws the objects of an episode, and rewards those at their places.

    Args:
        benchmark: The benchmark.
        goals: Middle of each object's place, x y, m.
        within: Whether an offset x y from the middle, m, is inside of a place.
        placed: Whether an object is at its place, moving or not.
        grip: Returns the point of an object that hands reach for, in the world, m.
        floor: Height of the places, m.
        lift_height: Height to which lifting is rewarded, above the floor, m.
        pick_one: Whether each episode has one of the objects, drawn at reset.
        stages: Staged reward of each object.

    Attributes:
        active: The objects of this episode.
        number: Index of the object of this episode, with `pick_one`.
    """

    def __init__(
        self,
        benchmark: ObjectBenchmark,
        goals: Mapping[str, tuple[float, float]],
        *,
        within: Callable[[float, float], bool],
        placed: Callable[[str], bool],
        grip: Callable[[str], Vector],
        floor: float,
        lift_height: float,
        pick_one: bool,
        stages: StagedReward,
    ) -> None:
        self._benchmark, self._goals, self._names = benchmark, goals, tuple(goals)
        self._within, self._placed, self._grip = within, placed, grip
        self._floor, self._lift_height = floor, lift_height
        self._pick_one, self._stages = pick_one, stages
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
        """Whether an object is at rest at its place, and no hand is near."""
        return (
            self._placed(name)
            and self._stages.has_left(self._benchmark.distance(self._grip(name)))
            and self._benchmark.scene.at_rest(name)
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
        dx, dy, above = self._offset(name)
        return self._stages.value(
            distance=self._benchmark.distance(self._grip(name)),
            grasped=self._benchmark.scene.grasped(name),
            missing=max(self._lift_height - above, 0.0),
            aside=math.hypot(dx, dy),
            over=self._within(dx, dy),
        )

    def _offset(self, name: str) -> tuple[float, float, float]:
        """Return the offset of an object from its place, m."""
        x, y, z = self._benchmark.states[name].position.tolist()
        goal_x, goal_y = self._goals[name]
        return x - goal_x, y - goal_y, z - self._floor
