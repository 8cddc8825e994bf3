import numpy as np
import pytest
from conftest import penetration, put
from posing import DOWN, act_at_random, fingers, reach

import wbc_suite

FLOOR = 0.81
TARGET, THROWN, START = (0.24, 0.45), (-0.24, 0.45), (0.24, -0.45)
LYING = (0.5, 0.5, 0.5, 0.5)


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make("TwoArmTransport")


def lie(env, payload, trash, lifted=0.0):
    """Put payload and trash on a floor 0.1 mm below its surface, or higher."""
    env.reset(seed=0)
    at = (payload[0] - 0.03, payload[1], FLOOR + 0.018 - 1e-4 + lifted)
    cube = (*trash[:2], (trash[2] if len(trash) > 2 else FLOOR) + 0.02 - 1e-4)
    return put(env, payload=(at, LYING), trash=(cube, None))


def settle(env):
    for _ in range(5):
        env.step(env.hold_action)


def test_both_in_their_bins_is_a_success(env):
    task = lie(env, TARGET, THROWN)
    settle(env)
    assert task.success()
    assert task.reward(shaped=False) == task.reward(shaped=True) == 1.0


def test_it_stays_a_success(env):
    task = lie(env, TARGET, THROWN)
    for _ in range(10):
        env.step(env.hold_action)
    assert task.success()


def test_trash_that_a_hand_grasps_in_its_bin_is_no_success(env):
    task = lie(env, TARGET, THROWN)
    settle(env)
    reach(env, 1, np.array([*THROWN, FLOOR + 0.025]), DOWN)
    fingers(env, 1, 0.04)
    assert task.success()
    fingers(env, 1, 0.0195)
    assert task.scene.grasped("trash")
    assert not task.success()


@pytest.mark.parametrize(
    ("payload", "trash", "lifted"),
    [
        (TARGET, TARGET, 0.0),  # the trash was not thrown away
        (START, THROWN, 0.0),  # arm 1 alone: the payload is where it was
        (TARGET, THROWN, 0.003),  # the payload still hangs 3 mm over the floor
        (THROWN, TARGET, 0.0),  # the wrong bins
        (TARGET, (0.0, 0.45, 0.80), 0.0),  # the trash on the table between
        (TARGET, (-0.24, 0.45, 0.86), 0.0),  # the trash in the air over its bin
        ((0.2, 0.0), THROWN, 0.0),  # the payload between the tables: no handover
    ],
)
def test_near_misses_are_no_success(env, payload, trash, lifted):
    task = lie(env, payload, trash, lifted)
    assert not task.success()
    assert task.reward(shaped=False) == 0.0
    assert 0.0 <= task.reward(shaped=True) < 1.0


def test_the_reward_rises_as_things_get_into_their_bins(env):
    start = lie(env, START, TARGET).reward(shaped=True)
    thrown = lie(env, START, THROWN).reward(shaped=True)
    assert start < 0.5 < thrown < 0.75
    near = 1 - np.tanh(np.hypot(0.9, 0.03))  # origins; the payload 1.8 cm over a floor
    assert thrown == pytest.approx(0.5 + 0.25 * near, abs=1e-3)


def test_it_starts_closed_with_the_keys_of_datasets(env):
    for seed in range(10):
        seen, info = env.reset(seed=seed)
        assert not info["success"]
        assert penetration(env) < 5e-4
        for _ in range(5):
            env.step(env.hold_action)
        assert env.benchmark.is_in("payload", "start_bin")
        assert env.benchmark.is_in("trash", "target_bin")
        assert seen["lid_handle_pos"][2] > 0.95
        assert (seen["payload_in_target_bin"], seen["trash_in_trash_bin"]) == (0, 0)
    assert seen["object-state"].shape == (41,)


@pytest.mark.sample(1)
@pytest.mark.slow
@pytest.mark.parametrize("robots", ["Baxter", "Tiago", "GR1"])
def test_random_actions_leave_everything_in_bounds(robots):
    env = wbc_suite.make("TwoArmTransport", robots=robots, reward_shaping=True)
    env.reset(seed=1)
    act_at_random(env, 500)
