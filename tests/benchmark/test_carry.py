import math

import mujoco
import pytest
from conftest import hand_touches, penetration
from feet import count, hold, lie_at, make, stand_at

import wbc_suite
from wbc_suite.errors import ConfigError

HOLD, ALONE = 20, 6
REST = 0.8 + 0.10 - 1e-4  # height of the pot's middle on a table, m
GOAL = (-0.9, 1.9)


@pytest.fixture(scope="module")
def env():
    return make("Carry", "GR1FreeBody", reward_shaping=True)


def put_pot(env, x, y, z, *, tilt=0.0, velocity=(0.0, 0.0, 0.0)):
    quat = (math.cos(tilt / 2), math.sin(tilt / 2), 0.0, 0.0)
    env.benchmark.states["pot"].move((x, y, z), quat)
    env.simulation.data.joint("pot_joint").qvel[:3] = velocity
    mujoco.mj_forward(env.simulation.model, env.simulation.data)


def started(env):
    env.reset(seed=0)
    stand_at(env, -0.9, 0.0)
    return env.benchmark


def carry(env, monkeypatch, steps=30, hands=2):
    """Let the pot be in the air for some actions, touched by some hands.

    With a robot's own hands the expert carries it in tests/experts/test_experts.py: a
    pot that lacks one of them for `alone` seconds in the air is no success there.
    """
    with monkeypatch.context() as held:
        held.setattr(env.benchmark, "hands_at_pot", lambda: hands)
        put_pot(env, -0.6, 0.8, 1.2)
        count(env, steps)


def test_a_carried_pot_on_the_other_table_is_a_success(env, monkeypatch):
    task = started(env)
    carry(env, monkeypatch)
    assert task.carried
    put_pot(env, *GOAL, REST)
    assert task.is_put_down()
    assert not count(env, HOLD - 1).success()
    assert count(env, 1).success()
    assert task.reward(shaped=True) == task.reward(shaped=False) == 1.0


@pytest.mark.parametrize(
    ("place", "more"),
    [
        ((GOAL[0], GOAL[1], REST + 0.02), {}),  # above the table
        ((GOAL[0] + 0.31, GOAL[1], REST), {}),  # at its edge
        ((GOAL[0], GOAL[1] - 0.31, REST), {}),
        ((*GOAL, REST), {"velocity": (0.06, 0.0, 0.0)}),  # pushed
        ((*GOAL, REST + 0.012), {"tilt": 0.21}),
        ((*GOAL, REST - 0.03), {"tilt": math.pi / 2}),
        ((-0.2, 0.0, REST), {}),  # on the first table
        ((*GOAL, 0.0999), {}),  # under the table
    ],
)
def test_near_misses_are_no_success(env, monkeypatch, place, more):
    task = started(env)
    carry(env, monkeypatch)
    put_pot(env, *place, **more)
    assert not task.is_put_down()
    assert not count(env, 2 * HOLD).success()
    assert task.reward(shaped=False) == 0.0
    assert 0.0 <= task.reward(shaped=True) < 1.0


@pytest.mark.parametrize("hands", [0, 1])
def test_a_pot_that_is_thrown_or_carried_by_one_hand_does_not_count(
    env, monkeypatch, hands
):
    task = started(env)
    carry(env, monkeypatch, steps=ALONE, hands=hands)
    assert task.carried
    put_pot(env, -0.2, 0.0, REST)
    count(env, 1)
    carry(env, monkeypatch, steps=ALONE + 1, hands=hands)
    assert not task.carried
    put_pot(env, *GOAL, REST)
    assert task.is_put_down()
    assert not count(env, 2 * HOLD).success()
    assert task.reward(shaped=True) < 0.3
    put_pot(env, -0.2, 0.0, REST)  # it may be tried again from the first table
    assert count(env, 1).carried


def test_a_pot_from_the_floor_does_not_count(env, monkeypatch):
    task = started(env)
    put_pot(env, -0.6, 0.9, 0.0999)
    count(env, 1)
    carry(env, monkeypatch)
    put_pot(env, *GOAL, REST)
    assert task.is_put_down()
    assert not count(env, 2 * HOLD).success()


def test_a_pot_that_really_flies_to_the_other_table_does_not_count(env):
    started(env)
    put_pot(env, GOAL[0], 0.9, 1.2, velocity=(0.0, 2.0, 1.0))
    for _ in range(60):
        *_, info = env.step(env.hold_action)
        assert not info["success"]
    assert not env.benchmark.carried


def test_a_pot_that_is_still_held_is_not_put_down(env, monkeypatch):
    task = started(env)
    carry(env, monkeypatch)
    put_pot(env, *GOAL, REST)
    hand_touches(monkeypatch, task, "pot")
    assert not count(env, 2 * HOLD).success()


def test_a_robot_that_walks_or_has_fallen_is_no_success(env, monkeypatch):
    task = started(env)
    carry(env, monkeypatch)
    put_pot(env, *GOAL, REST)
    for _ in range(2 * HOLD):
        *_, info = hold(env, 1, walk=[0.0, 0.0, 0.002])
        assert not info["success"]
    lie_at(env, -1.5, 0.0)
    *_, terminated, _, info = env.step(env.hold_action)
    assert terminated
    assert "GR1FreeBody fell" in info["failure"]
    stand_at(env, -0.9, 0.0)
    assert not count(env, 2 * HOLD).success()
    assert task.failure() is not None


def test_the_reward_grows_on_the_way(env, monkeypatch):
    task = started(env)
    rewards = []
    for share in (0.0, 0.3, 0.6, 1.0):
        put_pot(env, GOAL[0] * share, GOAL[1] * share, 1.5)
        rewards.append(task.reward(shaped=True))
    put_pot(env, *GOAL, REST)
    rewards.append(task.reward(shaped=True))
    assert rewards[1:] == sorted(rewards[1:])
    assert rewards[-1] == pytest.approx(0.4 + 0.25, abs=0.05)


def test_the_pot_starts_at_rest_with_a_handle_for_each_hand(env):
    for seed in range(20):
        observation, info = env.reset(seed=seed)
        assert not info["success"]
        assert penetration(env) < 5e-4
        assert observation["handle0_xpos"][1] < observation["handle1_xpos"][1]
    *_, info = hold(env, 20)
    assert env.benchmark.supports() == {env.simulation.model.geom("table_from").id}


@pytest.mark.parametrize("robot", ["Spot", "SpotWithArm"])
def test_a_robot_with_fewer_than_two_hands_is_refused(robot):
    with pytest.raises(ConfigError, match=rf"Carry needs 2 hand\(s\); {robot} has"):
        wbc_suite.make("Carry", robots=robot)
