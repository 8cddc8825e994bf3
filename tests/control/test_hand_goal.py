"""Goals of a hand against Pinocchio's exponential maps."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from wbc_suite.control.part.hand_goal import HandGoal
from wbc_suite.control.part.part_settings import ROUNDING
from wbc_suite.control.poses import pose_vector
from wbc_suite.errors import ConfigError


def random_pose(rng):
    return pin.SE3(pin.exp3(2.0 * rng.normal(size=3)), rng.normal(size=3))


def goal_at(pose, *, frame="base", update="desired", position=None, turn=None):
    settings = SimpleNamespace(
        input_ref_frame=frame,
        goal_update_mode=update,
        position_limits=position,
        orientation_limits=turn,
    )
    goal = HandGoal(settings)
    goal.reset(pose_vector(pose))
    return goal


def stepped(pose, step, axes):
    """Return a pose shifted and turned along axes."""
    R = pin.exp3(axes @ step[3:]) @ pose.rotation
    return pin.SE3(R, pose.translation + axes @ step[:3])


def origin(goal, hand, step, axes):
    """Return the goal with the hand's place in those components that a step moves."""
    moved = (np.abs(step) > ROUNDING).astype(float)
    away = axes.T @ (hand.translation - goal.translation)
    turn = axes.T @ pin.log3(hand.rotation @ goal.rotation.T)
    return stepped(goal, moved * np.concatenate([away, turn]), axes)


@pytest.mark.parametrize("frame", ["base", "world", "eef"])
@pytest.mark.parametrize("update", ["achieved", "desired"])
@pytest.mark.parametrize("size", [0.0, 1e-9, 0.1, 3.0])
def test_a_step_moves_the_goal_along_its_axes(frame, update, size):
    rng = np.random.default_rng(0)
    for _ in range(20):
        pose, hand = random_pose(rng), random_pose(rng)
        step = size * rng.normal(size=6) * rng.integers(0, 2, 6)
        axes = pose.rotation if frame == "eef" else np.eye(3)
        start = origin(pose, hand, step, axes) if update == "achieved" else pose
        goal = goal_at(pose, frame=frame, update=update)
        goal.step(step, pose_vector(hand))
        assert_allclose(goal.pose, stepped(start, step, axes), atol=1e-13)


@pytest.mark.parametrize("update", ["achieved", "desired"])
@pytest.mark.parametrize("size", [0.0, 0.4 * ROUNDING])
def test_a_step_of_zero_keeps_the_goal_bit_for_bit(update, size):
    rng = np.random.default_rng(1)
    pose, hand = random_pose(rng), random_pose(rng)
    goal = goal_at(pose, update=update)
    before = goal.pose.copy()
    goal.step(np.full(6, size), pose_vector(hand))
    assert_array_equal(goal.pose, before)


def test_components_without_a_step_keep_their_goal():
    pose = pin.SE3(pin.exp3(np.array([0.1, 0.2, 0.3])), np.array([1.0, 2.0, 3.0]))
    turn = pin.exp3(np.array([0.2, 0.0, 0.0]))
    hand = pin.SE3(turn @ pose.rotation, pose.translation + np.array([0.1, 0.2, 0.3]))
    goal = goal_at(pose, update="achieved")
    goal.step(np.array([0, 1e-3, 0, 0, 0, 0.0]), pose_vector(hand))
    assert_allclose(goal.pose.translation, [1.0, 2.201, 3.0])
    assert_allclose(goal.pose.rotation, pose.rotation, atol=1e-15)


@pytest.mark.parametrize("frame", ["base", "eef"])
@pytest.mark.parametrize("update", ["achieved", "desired"])
def test_the_step_to_a_target_leads_there(frame, update):
    rng = np.random.default_rng(2)
    for _ in range(20):
        pose, target = random_pose(rng), random_pose(rng)
        goal = goal_at(pose, frame=frame, update=update)
        hand = (
            pose if update == "desired" else stepped(pose, 0.1 * np.ones(6), np.eye(3))
        )
        step = goal.step_to(target, pose_vector(hand))
        goal.step(step, pose_vector(hand))
        assert_allclose(goal.pose, target, atol=1e-12)


def test_steps_of_an_hour_leave_a_rotation():
    rng = np.random.default_rng(3)
    pose = random_pose(rng)
    goal = goal_at(pose, frame="eef")
    for _ in range(72_000):
        goal.step(rng.normal(size=6), pose_vector(pose))
    R = goal.pose.rotation
    assert_allclose(R @ R.T, np.eye(3), atol=1e-12)


def test_goals_stay_within_limits_component_by_component():
    rng = np.random.default_rng(4)
    position = ((-0.1, -0.2, 0.0), (0.1, 0.3, 0.5))
    turn = ((-0.2, -0.3, -np.inf), (0.2, 0.1, np.inf))
    for _ in range(100):
        start = random_pose(rng)
        away = rng.normal(size=3)
        away *= rng.uniform(0.0, 3.0) / np.linalg.norm(away)
        place = rng.normal(size=3)
        goal = goal_at(start, position=position, turn=turn)
        goal.set(pin.SE3(pin.exp3(away) @ start.rotation, place))
        assert_array_equal(goal.pose.translation, np.clip(place, *position))
        expected = pin.exp3(np.clip(away, *turn)) @ start.rotation
        assert_allclose(goal.pose.rotation, expected, atol=1e-12)


def test_goals_within_limits_are_left_bit_for_bit():
    start = pin.SE3(pin.exp3(np.array([0.1, -0.3, 0.2])), np.array([0.5, 0.0, -1.0]))
    goal = goal_at(start, position=(-1.0, 1.0), turn=(-0.5, 0.5))
    R = pin.exp3(np.array([0.1, -0.3, 0.4])) @ start.rotation
    goal.set(pin.SE3(R, np.array([0.4, 0.9, -0.9])))
    assert_array_equal(goal.pose.rotation, R)
    assert_array_equal(goal.pose.translation, [0.4, 0.9, -0.9])


@pytest.mark.parametrize(
    ("limits", "message"),
    [(((0.0, 1.0), (1.0, 2.0)), "2 values instead of 1 or 3"), ((1.0, 0.0), "exceed")],
)
def test_limits_of_goals_are_checked(limits, message):
    with pytest.raises(ConfigError, match=f"position_limits.*{message}"):
        goal_at(pin.SE3.Identity(), position=limits)
