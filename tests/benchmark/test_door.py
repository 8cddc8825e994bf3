import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.catalogue import Catalogue


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make("Door", robots="Panda")


def test_it_stands_on_a_table(env):
    assert env.simulation.model.body("table").pos[2] == pytest.approx(0.8)


def turn(env, *, hinge=0.0, lever=0.0):
    data = env.simulation.data
    data.joint("door_panel_joint").qpos[0] = hinge
    data.joint("door_handle_joint").qpos[0] = lever
    mujoco.mj_forward(env.simulation.model, data)
    return env.benchmark


def test_an_open_door_is_a_success(env):
    env.reset(seed=0)
    door = turn(env, hinge=0.301)
    assert door.success()
    assert door.reward(shaped=False) == door.reward(shaped=True) == 1.0


@pytest.mark.parametrize(
    ("hinge", "lever"),
    [(0.0, 0.0), (0.0, 1.6), (0.299, 1.6), (-0.31, 0.0), (0.04, 0.0)],
)
def test_near_misses_are_no_success(env, hinge, lever):
    env.reset(seed=0)
    door = turn(env, hinge=hinge, lever=lever)
    assert not door.success()
    assert door.reward(shaped=False) == 0.0
    assert 0.0 <= door.reward(shaped=True) <= 0.5


def test_the_reward_rises_with_the_lever_and_the_hand(env):
    env.reset(seed=0)
    rewards = [turn(env, lever=a).reward(shaped=True) for a in (0.0, 0.5, 1.5708)]
    steps = np.array([0.5, 1.5708 - 0.5]) * 0.25 / 1.5708
    np.testing.assert_allclose(np.diff(rewards), steps, atol=1e-3)  # the lever moves
    env.benchmark.hands[0].position[:] = env.benchmark.handle_position
    assert env.benchmark.reward(shaped=True) == pytest.approx(0.5)


def pull(env, torque, *, lever):
    """Pull the door for a second with the lever held at an angle."""
    data = env.simulation.data
    for _ in range(20):
        turn(env, hinge=data.joint("door_panel_joint").qpos[0], lever=lever)
        data.joint("door_panel_joint").qfrc_applied[0] = torque
        _, _, _, _, info = env.step(env.hold_action)
    data.qfrc_applied[:] = 0.0
    return info["success"]


def test_the_latch_holds_until_the_lever_is_turned(env):
    env.reset(seed=0)
    assert not pull(env, 1.0, lever=0.0)
    env.reset(seed=0)
    assert pull(env, 1.0, lever=1.5)


def test_a_door_without_latch_opens_at_once(tmp_path):
    text = Catalogue().find("tasks", "door", kind="file").read_text()
    path = tmp_path / "door.toml"
    path.write_text(text.replace("latch = true", "latch = false"))
    free = wbc_suite.make(path, robots="Panda")
    observation, _ = free.reset(seed=0)
    assert "handle_qpos" not in observation
    assert pull(free, 1.0, lever=0.0)


def test_doors_stand_where_datasets_have_them(env):
    turns = []
    for seed in range(20):
        observation, _ = env.reset(seed=seed)
        frame = env.simulation.data.body("door")
        assert -0.131 < frame.xpos[0] < -0.109
        assert -0.361 < frame.xpos[1] < -0.339
        turns.append(np.arctan2(frame.xmat[3], frame.xmat[0]))
        np.testing.assert_array_equal(
            observation["handle_pos"], env.benchmark.handle_position
        )
        way = observation["handle_pos"] - observation["robot0_eef_pos"]
        np.testing.assert_allclose(observation["handle_to_eef_pos"], way, atol=1e-15)
    assert -0.25 <= min(turns) < -0.15
    assert -0.1 < max(turns) <= 0.0
    assert observation["object-state"].shape == (14,)
