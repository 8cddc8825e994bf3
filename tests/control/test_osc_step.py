import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from wbc_suite.control.part.osc_goal import GoalLimits, step_origin, stepped
from wbc_suite.control.part.osc_step import bound_goal, relative_pose, take_step

FREE = np.array([[-np.inf] * 3, [np.inf] * 3])


def flat(pose):
    return np.concatenate([pose.rotation.ravel(), pose.translation])


def random_pose(rng):
    return pin.SE3(pin.exp3(2.0 * rng.normal(size=3)), rng.normal(size=3))


def take(pose, step, *, now=None, in_hand=False):
    """Take a step without limits; it counts from `now`, where that is given."""
    goal, start = flat(pose), flat(pose)[:9]
    rules = (in_hand, now is not None)
    hand = np.zeros(12) if now is None else flat(now)
    take_step(goal, step, hand, rules, start, FREE, FREE)
    return goal


@pytest.mark.parametrize("in_hand", [False, True])
@pytest.mark.parametrize("from_hand", [False, True])
@pytest.mark.parametrize("size", [0.0, 1e-9, 0.1, 3.0])
def test_a_step_is_what_the_readable_form_says(in_hand, from_hand, size):
    rng = np.random.default_rng(0)
    for _ in range(50):
        pose, now = random_pose(rng), random_pose(rng)
        step = size * rng.normal(size=6) * rng.integers(0, 2, 6)
        axes = pose.rotation if in_hand else np.eye(3)
        origin = step_origin(pose, now, step, axes) if from_hand else pose
        expected = flat(stepped(origin, step, axes))
        taken = take(pose, step, now=now if from_hand else None, in_hand=in_hand)
        assert_allclose(taken, expected, atol=1e-13)


def test_a_step_in_the_hands_axes_is_a_motion_of_the_hand():
    rng = np.random.default_rng(5)
    pose, step = random_pose(rng), rng.normal(size=6)
    turned = pose.rotation @ pin.exp3(step[3:])
    moved = take(pose, step, in_hand=True)
    assert_allclose(moved[:9].reshape(3, 3), turned, atol=1e-14)
    assert_allclose(moved[9:], pose.act(step[:3].copy()), atol=1e-14)


def test_steps_of_an_hour_leave_a_rotation():
    rng = np.random.default_rng(1)
    goal, now, start = flat(random_pose(rng)), np.zeros(12), np.zeros(9)
    for _ in range(72_000):
        take_step(goal, rng.normal(size=6), now, (True, False), start, FREE, FREE)
    R = goal[:9].reshape(3, 3)
    assert_allclose(R @ R.T, np.eye(3), atol=1e-12)


def test_goals_stay_within_limits_component_by_component():
    rng = np.random.default_rng(2)
    position = np.array([[-0.1, -0.2, 0.0], [0.1, 0.3, 0.5]])
    turn = np.array([[-0.2, -0.3, -np.inf], [0.2, 0.1, np.inf]])
    for _ in range(100):
        start = random_pose(rng)
        away = rng.normal(size=3)
        away *= rng.uniform(0.0, 3.0) / np.linalg.norm(away)
        pose = pin.SE3(pin.exp3(away) @ start.rotation, rng.normal(size=3))
        goal = flat(pose)
        bound_goal(goal, flat(start)[:9], position, turn)
        assert_array_equal(goal[9:], np.clip(pose.translation, *position))
        expected = pin.exp3(np.clip(away, *turn)) @ start.rotation
        assert_allclose(goal[:9].reshape(3, 3), expected, atol=1e-12)
        readable = GoalLimits(position=position, turn=turn)
        assert_allclose(goal, flat(readable.nearest(pose, start.rotation)), atol=1e-13)


def test_goals_within_limits_are_left_bit_for_bit():
    rng = np.random.default_rng(3)
    start = flat(random_pose(rng))
    goal = start.copy()
    goal[9:] = 0.1, 0.2, 0.3
    before = goal.copy()
    bound_goal(goal, start[:9], np.array([[0.0] * 3, [1.0] * 3]), 0.1 * FREE)
    limits = np.array([[-0.1] * 3, [0.1] * 3])
    bound_goal(goal, start[:9], np.array([[0.0] * 3, [1.0] * 3]), limits)
    assert_array_equal(goal, before)


def test_a_pose_is_seen_from_a_body():
    rng = np.random.default_rng(4)
    body, hand = random_pose(rng), random_pose(rng)
    seen = np.zeros(12)
    frames = (flat(body)[:9], body.translation, flat(hand)[:9], hand.translation)
    relative_pose(*frames, seen)
    assert_allclose(seen, flat(body.actInv(hand)), atol=1e-14)
