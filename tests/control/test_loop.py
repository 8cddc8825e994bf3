"""The compiled loop does what the plain one does, for any mix of laws."""

import subprocess
import sys

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.control import BasicController, load_composite_controller_config
from wbc_suite.control.run.advance import advance
from wbc_suite.envs import Simulation

CASES = [
    ("Panda", "BASIC"),
    ("Panda", "WHOLE_BODY_IK"),
    ("Panda", "IK_POSE"),
    ("Tiago", "BASIC"),
    pytest.param("Baxter", "BASIC", marks=pytest.mark.slow),
    pytest.param("GR1", "BASIC", marks=pytest.mark.slow),
    pytest.param("GR1", "WHOLE_BODY_IK", marks=pytest.mark.slow),
    ("SpotWithArm", "WHOLE_BODY_IK"),
    ("GR1FreeBody", "BASIC"),
    pytest.param("SpotWithArm", "BASIC", marks=pytest.mark.slow),
    pytest.param("GR1FreeBody", "WHOLE_BODY_IK", marks=pytest.mark.slow),
    pytest.param("PandaOmron", "HYBRID_MOBILE_BASE", marks=pytest.mark.slow),
    pytest.param("TiagoDifferential", "BASIC", marks=pytest.mark.slow),
]

# Where a bound is only just met, rounding decides whether the active set of before or
# the solver answers; their optima of a whole body's second level are within 1.4e-8 rad
# of each other, and feet on the floor make 2e-6 rad/s of it. Before that: 3e-12.
CLOSE = {("GR1FreeBody", "WHOLE_BODY_IK"): 1e-5}


def made(robot, controller, **arguments):
    return wbc_suite.make(
        "Lift", robots=robot, controller_configs=controller, **arguments
    )


def states_of(env, actions):
    """Return qpos and qvel after each action."""
    env.reset(seed=3)
    found = []
    for action in actions:
        env.step(env.hold_action + action)
        data = env.unwrapped.simulation.data
        found.append(np.concatenate([data.qpos, data.qvel]))
    return np.array(found)


def moves(env, count=8):
    rng = np.random.default_rng(0)
    return rng.uniform(-0.1, 0.1, (count, env.action_space.shape[0]))


@pytest.mark.sample(4)
@pytest.mark.slow
@pytest.mark.parametrize(("robot", "controller"), CASES)
def test_plain_and_compiled_loop_give_the_same_states(robot, controller):
    compiled, plain = (made(robot, controller, compiled=c) for c in (True, False))
    assert compiled.simulation.compiled
    assert not plain.simulation.compiled
    actions, close = moves(compiled), CLOSE.get((robot, controller), 1e-7)
    expected = states_of(plain, actions)
    np.testing.assert_allclose(states_of(compiled, actions), expected, atol=close)
    assert np.ptp(expected, axis=0).max() > 1e-3  # it moved


def test_same_seed_gives_bit_equal_states():
    env = made("Panda", "BASIC")
    actions = moves(env)
    first = states_of(env, actions)
    np.testing.assert_array_equal(states_of(env, actions), first)
    again = states_of(made("Panda", "BASIC"), actions)
    np.testing.assert_array_equal(again, first)


@pytest.mark.parametrize("controller", ["BASIC", "IK_POSE", "WHOLE_BODY_IK"])
def test_an_action_is_one_call(controller, monkeypatch):
    """25 steps of physics, with five solves in between at 100 Hz."""
    env = made("Panda", controller)
    env.reset(seed=0)
    counted = []

    def count(*arguments, steps):
        counted.append(steps)
        return advance(*arguments, steps)

    monkeypatch.setattr("wbc_suite.envs.simulation.advance", count)
    env.step(env.hold_action)
    assert counted == [25]


class Pushing(BasicController):
    """BASIC with a torque more on the first joint, computed in Python."""

    calls = 0

    def compute(self, state):
        self.calls += 1
        commands = state.data.ctrl[state.actuator_ids]
        if state.time > 0.02:
            raise RuntimeError("the link to the robot is down")
        commands[0] += 5.0
        return commands


def pushed(alone, *, is_compiled):
    robot = alone("Panda", "BASIC")
    config = load_composite_controller_config("BASIC", "Panda")
    pairs = [(robot.state, Pushing(config, robot.state))]
    model, data = robot.simulation.model, robot.simulation.data
    simulation = Simulation(model, data, pairs, compiled=is_compiled)
    simulation.start()
    return simulation


@pytest.mark.parametrize("is_compiled", [True, False])
def test_commands_computed_in_python_override_those_of_laws(alone, is_compiled):
    simulation = pushed(alone, is_compiled=is_compiled)
    (controller,) = simulation.controllers
    simulation.tick(10)
    assert controller.calls == 10
    assert not simulation.compiled
    push = simulation.data.ctrl[0] - controller.laws[0].drives["command"][0]
    assert push == pytest.approx(5.0, abs=1e-12)
    assert simulation.data.qvel[0] > 0.05


@pytest.mark.parametrize("is_compiled", [True, False])
def test_an_error_in_commands_computed_in_python_passes_the_loop(alone, is_compiled):
    simulation = pushed(alone, is_compiled=is_compiled)
    with pytest.raises(RuntimeError, match="link to the robot"):
        simulation.tick(20)
    assert simulation.data.time == pytest.approx(0.022, abs=0.002)


def test_positions_after_a_step_are_those_of_the_joints():
    env = made("Panda", "BASIC")
    env.reset(seed=0)
    action = env.hold_action
    action[:3] = 1.0
    observation, *_ = env.step(action)
    simulation = env.simulation
    data = mujoco.MjData(simulation.model)
    data.qpos[:] = simulation.data.qpos
    mujoco.mj_kinematics(simulation.model, data)
    site = simulation.model.site("robot0_right_tcp").id
    np.testing.assert_array_equal(observation["robot0_eef_pos"], data.site_xpos[site])


def test_full_physics_reads_sensors_of_the_new_state_and_changes_none():
    lite, full = (made("Panda", "BASIC", lite_physics=x) for x in (True, False))
    actions = moves(lite)
    np.testing.assert_array_equal(states_of(lite, actions), states_of(full, actions))
    model, data = full.simulation.model, full.simulation.data
    before = data.qacc.copy()
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qacc, before, rtol=1e-6, atol=1e-6)
    assert not np.allclose(lite.simulation.data.qacc, before, rtol=1e-6, atol=1e-6)


def test_sensors_that_are_switched_off_stay_off():
    env = made("Panda", "BASIC")
    env.reset(seed=0)
    simulation = env.simulation
    simulation.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    before = simulation.data.sensordata.copy()
    env.step(env.hold_action + 0.1)
    np.testing.assert_array_equal(simulation.data.sensordata, before)


@pytest.mark.slow
def test_a_second_process_finds_the_machine_code():
    """Nothing is compiled again: the loop's statistics count hits of the cache."""
    code = (
        "import wbc_suite; from wbc_suite.control.run.advance import advance;"
        "wbc_suite.make('Lift', robots='Panda', controller_configs='BASIC');"
        "hits = sum(advance.stats.cache_hits.values());"
        "print(hits, sum(advance.stats.cache_misses.values()))"
    )
    for _ in range(2):
        result = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
    assert result.stdout.split() == ["1", "0"]
