"""What benchmarks share in which each thing is to be carried to a place of its own.

It is a level between `ObjectBenchmark` and the benchmarks, since reward, success and
the draw of one thing are alike in all of them.
"""

import math
from abc import abstractmethod
from collections.abc import Sequence

import numpy as np
from pydantic import PositiveFloat

from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.benchmark.stages import Stages
from wbc_suite.scene.placement import Sampler
from wbc_suite.sensing.reading import Reading

__all__ = ["CarryingBenchmark", "CarryingConfig"]


class CarryingConfig(ObjectBenchmarkConfig):
    """What the file of every such benchmark holds.

    Attributes:
        pick_one: Whether each episode has one of the things, drawn at reset.
        lift_height: To which lifting is rewarded, above where things are put down, m.
        stages: Numbers of the reward.
    """

    pick_one: bool = False
    lift_height: PositiveFloat
    stages: Stages


class CarryingBenchmark(ObjectBenchmark):
    """Each thing is to lie in its place, the hand withdrawn.

    Args:
        config: Numbers.
        names: The things.
        floor: Height of what they are put down on, m.

    Attributes:
        active: The things that have a part in this episode.
    """

    def __init__(
        self, config: CarryingConfig, names: Sequence[str], *, floor: float
    ) -> None:
        super().__init__(config)
        self._one, self._stages = config.pick_one, config.stages
        self._names, self._number = tuple(names), 0
        self._lifted = floor + config.lift_height
        self.active: tuple[str, ...] = self._names

    @abstractmethod
    def goal(self, name: str) -> tuple[float, float]:
        """Return where a thing belongs, x y in m."""

    @abstractmethod
    def lies(self, name: str) -> bool:
        """Whether a thing is where it belongs."""

    @abstractmethod
    def is_over(self, name: str) -> bool:
        """Whether a thing is where it belongs, or above that."""

    @abstractmethod
    def starts(self) -> Sampler:
        """Return what draws where the things of this episode start."""

    def hand_distance(self, name: str) -> float:
        """Return how far the nearest hand is from a thing, m."""
        return self.distance(self.states[name].position.tolist())

    def reset(self, rng: np.random.Generator) -> None:
        """Place the things; with `pick_one`, one of them."""
        if self._one:
            self._number = int(rng.integers(len(self._names)))
            self.active = (self._names[self._number],)
            self.park([name for name in self._names if name not in self.active])
        own = self.sampler
        self.place_things(rng, self.starts() if own is None else own)

    def observables(self) -> dict[str, Reading]:
        """Return poses in the world and as seen by the hands, quaternions x y z w.

        With `pick_one` the thing of the episode is called `obj`, and `obj_id` is its
        place in the list.
        """
        if not self._one:
            return self.hand_poses_of({name: name for name in self._names})
        return self.picked_poses(self._names, lambda: self._number)

    def is_placed(self, name: str) -> bool:
        """Whether a thing is where it belongs, and no hand is near or holds it."""
        return (
            self.lies(name)
            and self._stages.has_left(self.hand_distance(name))
            and not self.grasped(name)
        )

    def success(self) -> bool:
        """Whether each thing is in its place."""
        return all(self.is_placed(name) for name in self.active)

    def progress(self) -> float:
        """Return the shaped reward.

        1 for each thing in its place, and the best of the others' `Stages.reward`;
        divided by how many things there are.
        """
        waiting = [name for name in self.active if not self.is_placed(name)]
        best = max((self._stage(name) for name in waiting), default=0.0)
        return (len(self.active) - len(waiting) + best) / len(self.active)

    def _stage(self, name: str) -> float:
        x, y, z = self.states[name].position.tolist()
        gx, gy = self.goal(name)
        return self._stages.reward(
            distance=self.hand_distance(name),
            grasped=self.grasped(name),
            missing=max(self._lifted - z, 0.0),
            aside=math.hypot(x - gx, y - gy),
            over=self.is_over(name),
        )
