import itertools

import numpy as np
import pytest

from wbc_suite.control.composite.way import WayFinder
from wbc_suite.robot import load_robot

SPEEDS = np.full(9, 2.0)


def behind_a_wall(q):
    """Return whether q is free: a wall at 0 rad of joint 1, open where 2 is low."""
    return abs(q[0]) > 0.2 or q[1] < -0.7


def find(accept, checks=1500):
    model = load_robot("Panda").to_pinocchio()
    finder = WayFinder(model, SPEEDS, accept)
    start, end = np.zeros(9), np.zeros(9)
    start[3] = end[3] = -2.0
    start[0], end[0] = -1.0, 1.0
    found = [way for way in finder.find(start, end, checks) if way is not None]
    return found[0] if found else None, end


def test_the_way_goes_round_a_wall():
    way, end = find(behind_a_wall)
    assert way is not None
    np.testing.assert_array_equal(way[-1], end)
    for a, b in itertools.pairwise(way):
        steps = np.linspace(0.0, 1.0, 50)
        # Between the configurations that were checked a corner may be cut a little.
        shallow = [
            abs(q[0]) > 0.1 or q[1] < -0.5 for q in (a + s * (b - a) for s in steps)
        ]
        assert all(shallow)


def test_the_way_is_short():
    way, _ = find(behind_a_wall)
    times = [np.abs(b - a).max() / 2.0 for a, b in itertools.pairwise(way)]
    # Joint 2 down by 0.7 rad while joint 1 goes as far, across, and up again: 0.9 s.
    assert sum(times) < 1.4


@pytest.mark.parametrize("checks", [50, 400])
def test_a_closed_wall_ends_the_search(checks):
    way, _ = find(lambda q: abs(q[0]) > 0.2, checks)
    assert way is None
