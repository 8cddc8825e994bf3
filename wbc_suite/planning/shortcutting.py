"""Shortcutting: replace parts of a path or trajectory by shorter ones, at random."""

import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from wbc_suite.planning.collision_checker import Clearance
from wbc_suite.planning.time_parameterisation import ProfileGenerator
from wbc_suite.planning.trajectory import Segment, Trajectory
from wbc_suite.typing import Matrix, Vector

MIN_GAIN = 0.01  # s; a shortcut that gains less is not taken
CLEARANCE_TOLERANCE = 0.1  # of the clearance asked for
CHECKS = 2  # configurations checked at once


def shorten_path(
    path: Sequence[Vector],
    *,
    attempts: int,
    speed: Vector,
    is_free: Callable[[Vector, Vector], bool],
    rng: np.random.Generator,
) -> Iterator[list[Vector] | None]:
    """Shorten a path of straight lines, all joints at once and one joint alone in turn.

    Yields None after each attempt, and at last the path.

    Lengths are measured in time at the velocity limits, `speed`, shape (nv,). `is_free`
    returns whether the straight line between two configurations is free.

    Source: Geraerts and Overmars (2007), "Creating High-quality Paths for Motion
    Planning", IJRR 26(8).
    """
    path = list(path)
    for number in range(attempts):
        steps = np.abs(np.diff(path, axis=0)) / speed
        times = np.cumsum([0.0, *np.maximum(steps.max(axis=1), 1e-9)])
        cut = _one_joint if number % 2 else _all_joints
        first, last, part = cut(np.array(path), times, rng)
        if all(is_free(a, b) for a, b in itertools.pairwise(part)):
            path = [*path[:first], *part, *path[last:]]
        yield None
    yield path


def _all_joints(
    path: Matrix, times: Vector, rng: np.random.Generator
) -> tuple[int, int, Matrix]:
    """Return a straight line, and between which configurations of the path it fits."""
    cuts = np.sort(rng.uniform(0.0, times[-1], 2))
    first, last = np.searchsorted(times, cuts).tolist()
    part = np.array([np.interp(cuts, times, column) for column in path.T]).T
    return first, last, part


def _one_joint(
    path: Matrix, times: Vector, rng: np.random.Generator
) -> tuple[int, int, Matrix]:
    """Return a part of the path with one joint straightened, and where it fits."""
    first, last = np.sort(rng.choice(len(path), 2, replace=False)).tolist()
    part, joint = path[first : last + 1].copy(), rng.integers(path.shape[1])
    ends = times[[first, last]], part[[0, -1], joint]
    part[:, joint] = np.interp(times[first : last + 1], *ends)
    return first, last + 1, part


def shorten_trajectory(
    trajectory: Trajectory,
    generator: ProfileGenerator,
    *,
    attempts: int,
    spacing: float,
    clearance: Clearance,
    min_clearance: float,
    begin: Callable[[], float],
    rng: np.random.Generator,
) -> Iterator[None]:
    """Replace parts of a trajectory by faster free ones; yield now and then.

    It may be followed meanwhile.

    Args:
        trajectory: Changed in place.
        generator: Makes the faster parts.
        attempts: How many shortcuts to try.
        spacing: Greatest time between two collision checks, s.
        clearance: Clearance of a position of the trajectory.
        min_clearance: Clearance that a shortcut keeps, or that of its two ends where
            they are nearer, less a tenth of this, m.
        begin: Returns the time from which on the trajectory may still change.
        rng: Random numbers.

    Source: Hauser and Ng-Thow-Hing (2010), "Fast Smoothing of Manipulator Trajectories
    using Optimal Bounded-Acceleration Shortcuts", ICRA.
    """
    for _ in range(attempts):
        least, segments = begin(), trajectory.segments
        if len(segments) < 2 or trajectory.duration - least < spacing:
            return  # a single profile is the fastest there is
        first, last = np.sort(rng.uniform(least, trajectory.duration, 2)).tolist()
        ends = trajectory.state(first), trajectory.state(last)
        profile = generator.between(*ends)
        if profile is None or profile.duration > last - first - MIN_GAIN:
            continue
        segment = Segment.whole(profile)
        bound = min(min_clearance, *(clearance(x) for x, _ in ends))
        bound = max(0.0, bound) - CLEARANCE_TOLERANCE * min_clearance
        for number, x in enumerate(segment.check_positions(spacing)):
            if clearance(x) < bound:
                break
            if number % CHECKS == 0:
                yield
        else:
            if segments is trajectory.segments and first >= begin():
                trajectory.replace(first, segment, last)
        yield
