"""RRT-Connect: a collision-free path between two configurations."""

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from wbc_suite.kinematics.configuration import UNLIMITED, random_configuration
from wbc_suite.planning.collision_checker import Clearance
from wbc_suite.planning.shortcutting import shorten_path
from wbc_suite.typing import Vector

STRIDE = 0.25  # s; how far a tree grows at once
SHORTCUTS = 80  # that are tried on a path
LOCAL_SHARE = 0.7  # share of the samples that are drawn near the two ends
LOCAL_TIME = 0.6  # s; how near


class _Tree:
    """Configurations, each with the one that it was reached from."""

    def __init__(self, root: Vector) -> None:
        self.nodes, self.parents = [root], [-1]

    def branch(self) -> list[Vector]:
        """Return the configurations from the last one back to the root."""
        found: list[Vector] = []
        k = len(self.nodes) - 1
        while k >= 0:
            found.append(self.nodes[k])
            k = self.parents[k]
        return found


class RRTConnect:
    """Grows two trees, from both ends, until they meet; then shortens the path.

    Args:
        model: Model whose joints all have one parameter.
        speed: Velocity limits, shape (nv,); distances are measured in time.
        clearance: Clearance of a configuration; free where it is positive.
        spacing: Time at full speed between two collision checks, s.

    Source: Kuffner and LaValle (2000), "RRT-Connect: An Efficient Approach to
    Single-Query Path Planning", ICRA.
    """

    def __init__(
        self,
        model: pin.Model,
        *,
        speed: Vector,
        clearance: Clearance,
        spacing: float = 0.06,
    ) -> None:
        self._model, self._speed, self._clearance = model, speed, clearance
        self._spacing, self.checks = spacing, 0

    def search(
        self, start: Vector, end: Vector, *, max_checks: int
    ) -> Iterator[list[Vector] | None]:
        """Yield None now and then, and at last a path with both ends, if one was found.

        Configurations have the shape (nq,) and are joined by straight lines. The start
        need not be free. The random
        numbers are the same in every call.
        """
        rng = np.random.default_rng(0)
        trees, self.checks = (_Tree(start), _Tree(end)), 0
        aside = LOCAL_TIME * self._speed
        low, high = np.minimum(start, end) - aside, np.maximum(start, end) + aside
        endless = (self._model.upperPositionLimit > UNLIMITED) & (start != end)
        while self.checks < max_checks:
            for ours, theirs in (trees, trees[::-1]):
                sample = random_configuration(self._model, start, rng)
                sample[endless] = rng.uniform(low[endless], high[endless])
                if rng.uniform() < LOCAL_SHARE:
                    sample = np.clip(sample, low, high)
                self._grow(ours, sample, STRIDE)
                yield None
                if self._grow(theirs, ours.nodes[-1], np.inf):
                    there, back = trees[0].branch()[::-1], trees[1].branch()
                    yield from shorten_path(
                        [*there, *back[1:]],
                        attempts=SHORTCUTS,
                        speed=self._speed,
                        is_free=lambda a, b: self._free_share(a, b) == 1.0,
                        rng=rng,
                    )
                    return
                yield None

    def _grow(self, tree: _Tree, goal: Vector, stride: float) -> bool:
        """Grow from the nearest node; return whether the goal was reached."""
        times = (np.abs(np.array(tree.nodes) - goal) / self._speed).max(axis=1)
        parent = int(times.argmin())
        start, share = tree.nodes[parent], min(1.0, stride / max(times[parent], 1e-9))
        end = start + share * (goal - start)
        free = self._free_share(start, end)
        if free > 0.0:
            tree.nodes.append(start + free * (end - start))
            tree.parents.append(parent)
        return free == 1.0 and share == 1.0

    def _free_share(self, start: Vector, end: Vector) -> float:
        """Return which share of a straight line is free, from its start."""
        time = float((np.abs(end - start) / self._speed).max())
        count = max(1, int(np.ceil(time / self._spacing)))
        for k in range(1, count + 1):
            self.checks += 1
            if not self._clearance(start + (k / count) * (end - start)) > 0.0:
                return (k - 1) / count
        return 1.0
