"""Any rate of actions: the period, the time step, and what counts time."""

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.benchmark.standing import Standing
from wbc_suite.randomisation import Randomisation


@pytest.mark.parametrize("rate", [7.5, 15, 30, 60, 250, 500])
def test_actions_take_a_period_at_any_rate(rate):
    env = wbc_suite.make("Lift", robots="Panda", control_freq=rate).unwrapped
    _, info = env.reset(seed=0)
    for k in range(1, 4):
        info = env.step(env.hold_action)[-1]
        assert env.simulation.data.time == pytest.approx(k / rate, abs=1e-12)
    assert info["control_freq"] == env.metadata["render_fps"] == rate
    assert env.simulation.timestep == env.config.timestep
    written = mujoco.MjModel.from_xml_string(env.scene_xml)
    assert written.opt.timestep == pytest.approx(env.config.timestep, rel=1e-12)


def test_a_horizon_takes_as_long_at_any_rate():
    usual = wbc_suite.make("Lift", robots="Panda").unwrapped
    for rate in (10, 30):
        env = wbc_suite.make("Lift", robots="Panda", control_freq=rate).unwrapped
        assert env.horizon / rate == usual.horizon / 20
    env = wbc_suite.make("Lift", robots="Panda", control_freq=30, horizon=7).unwrapped
    assert env.horizon == 7


def test_delays_and_samples_are_those_in_seconds():
    """At 30 Hz a physics step takes 1.961 ms, of which 100 ms are 51."""
    changes = {"robot0_joint_pos": {"delay": 0.1}}
    env = wbc_suite.make(
        "Lift", robots="Panda", control_freq=30, observables=changes
    ).unwrapped
    env.reset(seed=0)
    arm = env.controllers[0].parts["right"].law.drives["qpos"]
    seen, true = [], []
    push = env.action_layout.pack({"right": np.full(6, 0.5)}, base=env.hold_action)
    for _ in range(8):
        observation = env.step(push)[0]
        seen.append(observation["robot0_joint_pos"][:7])
        true.append(env.simulation.data.qpos[arm].copy())
    np.testing.assert_allclose(seen[3:], true[:-3], atol=1e-12)  # 3 periods ago
    latency = Randomisation(latency=(0.1, 0.1))
    env = wbc_suite.make(
        "Lift", robots="Panda", control_freq=30, randomisation=latency
    ).unwrapped
    env.reset(seed=0)
    assert env.latency == 51


@pytest.mark.parametrize("rate", [10, 60])
def test_a_success_is_held_for_the_same_time_at_any_rate(rate, monkeypatch):
    """Of robots on feet: 0.95 s from the first action at which it holds."""
    env = wbc_suite.make("Reach", control_freq=rate).unwrapped
    env.reset(seed=0)
    monkeypatch.setattr(Standing, "stands", True)
    standing, start = env.benchmark.standing, env.simulation.data.time
    env.simulation.data.time = start + 1.0
    standing.observe(holds=True)
    for time, held in ((1.9, False), (1.95, True)):
        env.simulation.data.time = start + time
        standing.observe(holds=True)
        assert standing.held == held
