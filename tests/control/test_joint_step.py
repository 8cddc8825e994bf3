"""Compiled steps of joints' goals against what NumPy says in one line."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from wbc_suite.control.loop.table import DRIVE, LAW
from wbc_suite.control.part.joint_step import (
    NOTHING,
    StepField,
    follow,
    grip,
    step_joints,
)
from wbc_suite.kinematics.array_table import ArrayTable


def stepped(values, goal, qpos, places, achieved):
    """Return goals after a step of `0.5 + 2 values`, within -1 and 1."""
    drives, n = np.zeros(len(goal), DRIVE), len(goal)
    drives["qpos"] = places
    arrays = {
        StepField.GOAL: goal,
        StepField.GAIN: np.full(n, 2.0),
        StepField.OFFSET: np.full(n, 0.5),
        StepField.LOW: np.full(n, -1.0),
        StepField.HIGH: np.full(n, 1.0),
        StepField.QPOS: qpos,
    }
    step_joints(values, ArrayTable(StepField, arrays).table, drives, achieved)
    return goal


def test_steps_count_from_the_joints_or_from_their_goals():
    rng = np.random.default_rng(0)
    for achieved in (True, False):
        for _ in range(20):
            qpos, goal = rng.uniform(-1, 1, 9), rng.uniform(-1, 1, 5)
            places, values = rng.permutation(9)[:5], rng.uniform(-0.6, 0.1, 5)
            start = qpos[places] if achieved else goal
            expected = np.clip(start + 0.5 + 2.0 * values, -1.0, 1.0)
            taken = stepped(values, goal.copy(), qpos, places, achieved)
            assert_allclose(taken, expected, atol=1e-15)


def test_a_step_of_nothing_keeps_the_goal_wherever_the_joint_is():
    goal = np.array([0.3, 5.0])
    values = np.array([-0.25, -0.25 + 0.4 * NOTHING])
    assert_array_equal(
        stepped(values, goal.copy(), np.ones(2), np.arange(2), True), goal
    )


def test_a_grip_moves_each_joint_by_its_synergy_and_stops_it():
    record, drives = np.ones(1, LAW), np.zeros(3, DRIVE)
    rates = ("velocity", "acceleration", "jerk")
    for name in rates:
        drives[name] = 7.0
    synergy, opened = np.array([0, 1, 0]), np.array([0.0, 1.0, 2.0])
    grip(record, drives, np.array([1.0, 0.0]), synergy, opened, np.full(3, 0.5))
    assert_array_equal(drives["position"], [0.5, 1.25, 2.5])
    assert not any(drives[name].any() for name in rates)
    assert (record["since"][0], record["duration"][0]) == (0.0, np.inf)


def test_a_motion_to_follow_is_each_drives_column():
    record, drives = np.ones(1, LAW), np.ones(4, DRIVE)
    motion = np.random.default_rng(1).normal(size=(4, 4))
    follow(record, drives, motion)
    names = ("position", "velocity", "acceleration", "jerk")
    for row, name in zip(motion, names, strict=True):
        assert_array_equal(drives[name], row)
    assert (record["since"][0], record["duration"][0]) == (0.0, np.inf)
