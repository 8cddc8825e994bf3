import itertools

import numpy as np
import pytest

from wbc_suite.planning import RRTConnect
from wbc_suite.robot import load_robot

SPEEDS = np.full(9, 2.0)


def wall(q):
    """Return the clearance of q: a wall at 0 rad of joint 1, open where 2 is low."""
    return max(abs(q[0]) - 0.2, -0.7 - q[1])


def search(clearance, checks=1500):
    model = load_robot("Panda").to_pinocchio()
    planner = RRTConnect(model, speed=SPEEDS, clearance=clearance)
    start, end = np.zeros(9), np.zeros(9)
    start[3] = end[3] = -2.0
    start[0], end[0] = -1.0, 1.0
    paths = [p for p in planner.search(start, end, max_checks=checks) if p is not None]
    return paths[0] if paths else None, end, planner


def test_the_path_goes_around_a_wall():
    path, end, _ = search(wall)
    assert path is not None
    np.testing.assert_array_equal(path[-1], end)
    for a, b in itertools.pairwise(path):
        steps = np.linspace(0.0, 1.0, 50)
        # Between the configurations that were checked a corner may be cut a little.
        shallow = [
            abs(q[0]) > 0.1 or q[1] < -0.5 for q in (a + s * (b - a) for s in steps)
        ]
        assert all(shallow)


def test_the_path_is_short():
    path, _, _ = search(wall)
    times = [np.abs(b - a).max() / 2.0 for a, b in itertools.pairwise(path)]
    # Joint 2 down by 0.7 rad while joint 1 goes as far, across, and up again: 0.9 s.
    assert sum(times) < 1.4


def test_the_path_is_the_same_in_every_call():
    for a, b in zip(search(wall)[0], search(wall)[0], strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("checks", [50, 400])
def test_a_closed_wall_ends_the_search(checks):
    path, _, planner = search(lambda q: abs(q[0]) - 0.2, checks)
    assert path is None
    # One growth of both trees is finished: each checks at most 2 s / 0.06 s = 34 times.
    assert checks <= planner.checks <= checks + 4 * 34
