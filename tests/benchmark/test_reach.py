import numpy as np
import pytest
from feet import count, hold, lie_at, make, stand_at

import wbc_suite
from wbc_suite.errors import ConfigError

HOLD, NEAR = 20, 0.02


@pytest.fixture(scope="module", params=["SpotWithArm", "GR1FreeBody"])
def env(request):
    return make("Reach", request.param, reward_shaping=True)


def targets_at_hands(env, *offsets):
    """Put the robot at rest at its start, and targets this far from its hands."""
    env.reset(seed=0)
    stand_at(env, 0.0, 0.0)
    hold(env, 20)
    task = env.benchmark
    offsets = offsets or [(0.0, 0.0, 0.0)] * len(task.hands)
    for hand, target, by in zip(task.hands, task.targets, offsets, strict=False):
        target.move((hand.position + by).tolist())
    env.simulation.forward()
    task.standing.observe(False)
    return task


def test_hands_that_stay_at_their_targets_are_a_success(env):
    task = targets_at_hands(env)
    for k in range(HOLD):
        assert not task.success(), k
        _, reward, terminated, _, info = env.step(env.hold_action)
    assert info["success"]
    assert reward == 1.0
    assert not terminated


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_one_hand_that_is_too_far_is_no_success(env, axis):
    hands = len(env.benchmark.hands)
    by = np.zeros((hands, 3))
    by[-1, axis] = NEAR + 1e-3
    task = targets_at_hands(env, *by)
    assert task.standing.rests
    assert not count(env, 2 * HOLD).success()
    assert task.reward(shaped=False) == 0.0
    assert 0.5 < task.reward(shaped=True) < 0.95
    by[-1, axis] = NEAR - 1e-3
    targets_at_hands(env, *by)
    assert count(env, HOLD).success()


def test_hands_that_pass_their_targets_are_no_success(env):
    targets_at_hands(env)
    near = 0
    for _ in range(40):
        *_, info = hold(env, 1, walk=[0.0, 0.2, 0.0])  # the arms are carried along
        near += bool((env.benchmark.distances < NEAR).all())
        assert not info["success"]
    assert 0 < near < HOLD


def test_a_step_counts_anew(env):
    task = targets_at_hands(env)
    count(env, HOLD - 1)
    env.simulation.data.joint("robot0_root").qpos[2] += 0.05  # off the floor
    env.simulation.forward()
    task.after_step()
    env.simulation.data.joint("robot0_root").qpos[2] -= 0.05
    env.simulation.forward()
    assert not count(env, HOLD - 1).success()
    assert count(env, 1).success()


def test_a_fallen_robot_with_hands_at_targets_is_no_success(env):
    env.reset(seed=0)
    lie_at(env, 0.0, 0.0)
    task = env.benchmark
    for hand, target in zip(task.hands, task.targets, strict=True):
        target.move(hand.position.tolist())
    env.simulation.forward()
    assert (task.distances < 1e-9).all()
    assert not count(env, 2 * HOLD).success()
    *_, terminated, _, info = env.step(env.hold_action)
    assert terminated
    assert " fell: " in info["failure"]


def test_targets_are_inside_of_their_regions_on_the_side_of_their_hands(env):
    regions = env.benchmark.config.target.regions
    region = regions.get(env.robots[0].name, regions["default"])
    seen = []
    for seed in range(40):
        observation, info = env.reset(seed=seed)
        assert not info["success"]
        for hand, target in zip(
            env.benchmark.hands, env.benchmark.targets, strict=True
        ):
            side = f"{hand.name}_" if len(env.benchmark.hands) > 1 else ""
            at = observation[f"{side}target_pos"]
            way = observation[f"{side}gripper_to_target_pos"]
            np.testing.assert_allclose(at, target.position)
            np.testing.assert_allclose(way, at - hand.position, atol=1e-12)
            seen.append(at * [1.0, -1.0 if hand.name == "left" else 1.0, 1.0])
    for values, ends in zip(
        np.transpose(seen), (region.x, region.y, region.z), strict=True
    ):
        assert ends[0] <= values.min() < values.max() <= ends[1]
        assert np.ptp(values) > 0.7 * (ends[1] - ends[0])


def test_a_robot_without_an_arm_is_refused():
    with pytest.raises(ConfigError, match=r"Reach needs 1 hand\(s\); Spot has 0"):
        wbc_suite.make("Reach", robots="Spot")
