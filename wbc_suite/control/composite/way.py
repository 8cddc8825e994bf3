"""A way round what is in the way, between two configurations."""

import itertools
from collections.abc import Callable, Iterator

import numpy as np
import pinocchio as pin

from wbc_suite.control.part.postures import random_posture
from wbc_suite.typing import Matrix, Vector

__all__ = ["WayFinder"]

STRIDE = 0.25  # s; how far a tree grows at once
SPACING = 0.06  # s; between configurations that are checked
SHORTCUTS = 80
NEARBY = 0.7  # part of the draws that stay near the two ends
ASIDE = 0.6  # s; how near


class _Tree:
    """Configurations with the one that each was reached from."""

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


class WayFinder:
    """Grows two trees, from both ends, until they meet.

    Args:
        model: Model whose joints all have one parameter.
        speeds: Speed limits, shape (nv,); distances are measured in time.
        accept: Tells whether a configuration is free.

    Source: Kuffner and LaValle (2000), "RRT-Connect: An Efficient Approach to
    Single-Query Path Planning", ICRA.
    """

    def __init__(
        self, model: pin.Model, speeds: Vector, accept: Callable[[Vector], bool]
    ) -> None:
        self._model, self._speeds, self._accept = model, speeds, accept
        self.checks = 0

    def time(self, start: Vector, end: Vector) -> float:
        """Return how long joints need at full speed, s."""
        return float((np.abs(end - start) / self._speeds).max())

    def find(
        self, start: Vector, end: Vector, checks: int
    ) -> Iterator[list[Vector] | None]:
        """Search configurations to pass through, with straight lines in between.

        The random numbers are always the same ones.

        Args:
            start: Where to begin; need not be free.
            end: Where to arrive.
            checks: How many configurations to check before giving up.

        Yields:
            None now and then, and at last the way with both ends, if there is one.
        """
        rng = np.random.default_rng(0)
        trees, self.checks = (_Tree(start), _Tree(end)), 0
        aside = ASIDE * self._speeds
        near = np.minimum(start, end) - aside, np.maximum(start, end) + aside
        while self.checks < checks:
            for ours, theirs in (trees, trees[::-1]):
                drawn = random_posture(self._model, start, rng)
                if rng.uniform() < NEARBY:
                    drawn = np.clip(drawn, near[0], near[1])
                self._grow(ours, drawn, STRIDE)
                yield None
                if self._grow(theirs, ours.nodes[-1], np.inf):
                    there, back = trees[0].branch()[::-1], trees[1].branch()
                    yield from self._shortened([*there, *back[1:]], rng)
                    return
                yield None

    def _grow(self, tree: _Tree, goal: Vector, stride: float) -> bool:
        """Grow from the nearest node; return whether the goal was reached."""
        times = (np.abs(np.array(tree.nodes) - goal) / self._speeds).max(axis=1)
        parent = int(times.argmin())
        start, share = tree.nodes[parent], min(1.0, stride / max(times[parent], 1e-9))
        end = start + share * (goal - start)
        free = self._free_part(start, end)
        if free > 0.0:
            tree.nodes.append(start + free * (end - start))
            tree.parents.append(parent)
        return free == 1.0 and share == 1.0

    def _free_part(self, start: Vector, end: Vector) -> float:
        """Return how much of a straight line is free, from its start."""
        count = max(1, int(np.ceil(self.time(start, end) / SPACING)))
        for k in range(1, count + 1):
            self.checks += 1
            if not self._accept(start + (k / count) * (end - start)):
                return (k - 1) / count
        return 1.0

    def _shortened(
        self, way: list[Vector], rng: np.random.Generator
    ) -> Iterator[list[Vector] | None]:
        """Straighten parts of the way, all joints at once or one alone; yield it last.

        Source: Geraerts and Overmars (2007), "Creating High-quality Paths for Motion
        Planning", IJRR 26(8).
        """
        for number in range(SHORTCUTS):
            times = [max(self.time(a, b), 1e-9) for a, b in itertools.pairwise(way)]
            straighten = _one_joint if number % 2 else _all_joints
            first, last, part = straighten(np.array(way), np.cumsum([0.0, *times]), rng)
            if all(self._free_part(a, b) == 1.0 for a, b in itertools.pairwise(part)):
                way = [*way[:first], *part, *way[last:]]
            yield None
        yield way


def _all_joints(
    way: Matrix, times: Vector, rng: np.random.Generator
) -> tuple[int, int, Matrix]:
    """Return a straight line, and between which configurations of the way it fits."""
    cuts = np.sort(rng.uniform(0.0, times[-1], 2))
    first, last = np.searchsorted(times, cuts).tolist()
    part = np.array([np.interp(cuts, times, column) for column in way.T]).T
    return first, last, part


def _one_joint(
    way: Matrix, times: Vector, rng: np.random.Generator
) -> tuple[int, int, Matrix]:
    """Return a part of the way with one joint going straight, and where it fits."""
    first, last = np.sort(rng.choice(len(way), 2, replace=False)).tolist()
    part, joint = way[first : last + 1].copy(), rng.integers(way.shape[1])
    ends = times[[first, last]], part[[0, -1], joint]
    part[:, joint] = np.interp(times[first : last + 1], *ends)
    return first, last + 1, part
