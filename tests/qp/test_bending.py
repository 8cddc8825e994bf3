"""Damping by the rows that a stack presses against."""

import numpy as np
import pytest

from wbc_suite.qp.bending import RowBending

DT = 0.01


@pytest.fixture
def pulls():
    """One task that pulls the first of three joints with 2, and the last with 1."""
    W, e = np.array([[2.0, 0.0, 0.0]]), np.array([1.0])
    return W, e, np.array([0.0, 0.0, -1.0])


def test_pressing_rows_count_by_multiplier_and_longest_arm(pulls):
    bending = RowBending(0.5)
    rows = np.array([[0.1, -0.4, 0.0], [1.0, 0.0, 0.0]])
    bending.note(rows, np.array([-3.0, 0.0]), pulls, DT, kept=True)
    assert bending.value == pytest.approx(0.5 * 3.0 * 0.4)
    bending.note(rows, np.zeros(2), pulls, DT, kept=True)
    assert 0.9 * 0.6 < bending.value < 0.6


def test_rows_do_not_count_for_more_than_tasks_can_press(pulls):
    """Rows that nearly depend press in proportion to the damping that they cause."""
    bending = RowBending(0.5)
    rows = np.eye(3)
    for _ in range(100):
        multipliers = np.full(3, 10.0 * max(bending.value, 1.0))
        bending.note(rows, multipliers, pulls, DT, kept=True)
    assert bending.value == pytest.approx(0.5 * 1e6 * 3.0)
