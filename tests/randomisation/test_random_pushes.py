"""Pushes as part of the randomisation of an episode."""

import numpy as np
import pytest

import wbc_suite
from wbc_suite.randomisation import Randomisation
from wbc_suite.scene import PushConfig

PUSHES = PushConfig(force=(100.0, 100.0), interval=(0.5, 0.5))


def trunk_speed(env):
    return float(np.linalg.norm(env.simulation.data.qvel[:2]))


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make(
        "WalkTo",
        robots="Spot",
        controller_configs="WHOLE_BODY_ID",
        randomisation=Randomisation(pushes=PUSHES, mass=0.1, latency=(0.0, 0.02)),
    )


def test_the_trunk_is_pushed_when_it_is_said(env):
    env.reset(seed=0)
    assert [push.start for push in env.pushes][:3] == pytest.approx([0.5, 1.0, 1.5])
    speeds = [env.step(env.hold_action) and trunk_speed(env) for _ in range(14)]
    assert max(speeds[:10]) < 0.02
    assert speeds[11] > 0.1  # 10 N s on 65 to 80 kg
    assert {push.body for push in env.pushes} == {env.benchmark.standing.trunk}


def test_episodes_repeat_bit_by_bit(env):
    states = []
    for _ in range(2):
        env.reset(seed=3)
        for _ in range(30):
            env.step(env.hold_action)
        states.append(env.physics_state)
    np.testing.assert_array_equal(*states)
    saved = env.get_state()
    for _ in range(10):
        env.step(env.hold_action)
    later = env.physics_state
    env.set_state(saved)
    for _ in range(10):
        env.step(env.hold_action)
    np.testing.assert_array_equal(env.physics_state, later)


def test_directions_follow_the_seed(env):
    env.reset(seed=1)
    first = env.pushes
    env.reset(seed=2)
    assert env.pushes != first
