import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wbc_suite.devices.pipeline.config import RatesConfig
from wbc_suite.devices.pipeline.motion_limit import LimitedMotion, MotionLimit


def limits(speed, acceleration, jerk):
    return RatesConfig(speed=speed, acceleration=acceleration, jerk=jerk)


def follow(goals, rates, dt, size):
    motion, x, path = LimitedMotion(size, rates, dt), np.zeros(size), []
    for goal in goals:
        x = x + motion.step(goal - x)
        path.append(x)
    return np.array(path)


def worst(path, order, dt):
    """Greatest norm of a derivative, of a motion from rest at the origin."""
    padded = np.concatenate([np.zeros((3, path.shape[1])), path])
    differences = np.diff(padded, n=order, axis=0) / dt**order
    return np.linalg.norm(differences, axis=1).max()


@pytest.mark.slow
@settings(max_examples=60)
@given(
    goals=st.lists(
        st.tuples(*[st.floats(-1e3, 1e3)] * 2, st.integers(1, 20)), max_size=12
    ),
    speed=st.floats(0.05, 5.0),
    acceleration=st.floats(0.5, 50.0),
    jerk=st.floats(5.0, 5e3),
    dt=st.sampled_from([0.002, 0.01, 0.05]),
)
def test_whatever_the_goals_limits_hold_exactly(goals, speed, acceleration, jerk, dt):
    points = [np.array([x, y]) for x, y, times in goals for _ in range(times)]
    path = follow([*points, np.zeros(2)], limits(speed, acceleration, jerk), dt, 2)
    # Differences of positions lose digits: eps * size / dt^order.
    lost = 1e-15 * (1.0 + np.abs(path).max())
    assert worst(path, 1, dt) <= speed * (1 + 1e-9) + lost / dt
    assert worst(path, 2, dt) <= acceleration * (1 + 1e-9) + 4 * lost / dt**2
    assert worst(path, 3, dt) <= jerk * (1 + 1e-9) + 8 * lost / dt**3


@pytest.mark.parametrize("dt", [0.005, 0.01, 0.02])
def test_goal_is_reached_and_hardly_overshot(dt):
    goal = np.array([0.5, 0.1, 0.0])
    path = follow([goal] * round(2.0 / dt), limits(1.0, 10.0, 300.0), dt, 3)
    along = path @ goal / np.linalg.norm(goal)
    assert along.max() < np.linalg.norm(goal) + 0.003
    np.testing.assert_allclose(path[-1], goal, atol=1e-6)


def test_slow_motion_is_followed_closely():
    dt, speed = 0.01, 0.2
    goals = [np.array([speed * k * dt]) for k in range(200)]
    path = follow(goals, limits(1.0, 10.0, 300.0), dt, 1)
    assert goals[-1] - path[-1] < 0.06 * speed  # 60 ms behind


def test_pose_turns_by_the_shortest_way_within_limits():
    linear, angular = limits(1.0, 10.0, 300.0), limits(2.0, 20.0, 600.0)
    limit = MotionLimit(linear, angular, 0.01)
    start = pin.SE3(pin.exp3(np.array([0.3, -0.2, 2.9])), np.zeros(3))
    target = pin.SE3(pin.exp3(np.array([-0.4, 0.1, -2.9])), np.ones(3))
    limit.reset(start)
    before, fastest = start, 0.0
    for _ in range(400):
        pose = limit.apply(target)
        turned = pin.log3(pose.rotation @ before.rotation.T)
        fastest, before = max(fastest, np.linalg.norm(turned) / 0.01), pose
    assert fastest <= 2.0 + 1e-9
    assert pose.isApprox(target, 1e-6)
