"""What users do to an environment by mistake: an error or a wait, never silence."""

import operator
import os
import threading

import numpy as np
import pytest

import wbc_suite
from wbc_suite.envs.states import motion_size
from wbc_suite.errors import ConfigError, DescriptionError, PhysicsError
from wbc_suite.scene.objects import MjcfObject


@pytest.fixture(scope="module")
def lift():
    return wbc_suite.make("Lift", robots="Panda")


def test_a_step_before_the_first_reset_is_an_error():
    env = wbc_suite.make("Lift", robots="Panda").unwrapped
    with pytest.raises(PhysicsError, match=r"Call reset\(\) first"):
        env.step(env.hold_action)
    env.reset(seed=0)
    env.step(env.hold_action)


def test_three_threads_step_one_environment_in_turn(lift):
    """They crashed the process. The steps of all are done, each as a whole."""
    env, errors = lift.unwrapped, []
    env.reset(seed=0)
    period = 1.0 / env.config.control_freq

    def step():
        try:
            for _ in range(30):
                env.step(env.hold_action)
                env.observation()
        except Exception as error:  # noqa: BLE001 -- any would be the fault
            errors.append(error)

    threads = [threading.Thread(target=step) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    assert env.simulation.data.time == pytest.approx(90 * period)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_copies_after_a_fork_draw_episodes_of_their_own(lift):
    lift.reset(seed=0)

    def cube_after_reset(out):
        seen, _ = lift.reset()
        os.write(out, seen["cube_pos"].tobytes())

    places = []
    for _ in range(2):
        read, write = os.pipe()
        child = os.fork()
        if child == 0:
            cube_after_reset(write)
            os._exit(0)
        os.waitpid(child, 0)
        places.append(os.read(read, 1000))
        os.close(read)
        os.close(write)
    assert len(places[0]) > 0
    assert places[0] != places[1]


def test_an_unseeded_reset_goes_on_in_the_same_process(lift):
    """Only a fork draws anew; here episodes follow from the first seed."""
    cubes = []
    for _ in range(2):
        lift.reset(seed=7)
        cubes.append(lift.reset()[0]["cube_pos"])
    np.testing.assert_array_equal(*cubes)


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [("qvel", 1e6, "speed above 100000"), ("quat", 0.0, "quaternion")],
)
def test_states_that_cannot_be_are_refused(lift, place, value, message):
    env = lift.unwrapped
    env.reset(seed=0)
    state = env.physics_state
    if place == "qvel":
        state[motion_size(env.simulation.model) - 1] = value
    else:
        model = env.simulation.model
        free = next(
            a for a, t in zip(model.jnt_qposadr, model.jnt_type, strict=True) if t == 0
        )
        state[1 + free + 3 : 1 + free + 7] = value
    with pytest.raises(ConfigError, match=message):
        env.reset_to(state)
    env.reset(seed=0)
    env.step(env.hold_action)


def test_a_speed_that_cannot_be_ends_the_episode(lift):
    env = lift.unwrapped
    env.reset(seed=0)
    env.simulation.data.qvel[0] = 1e6
    *_, terminated, _, info = env.step(env.hold_action)
    assert terminated
    assert "BADQVEL" in info["physics_error"]


@pytest.mark.parametrize("timestep", [0.0, -0.002, np.nan, 1.0, 0.001])
def test_a_time_step_that_cannot_be_is_an_error(timestep):
    env = wbc_suite.make("Lift", robots="Panda").unwrapped
    env.reset(seed=0)
    env.simulation.model.opt.timestep = timestep
    info = env.step(env.hold_action)[-1]
    assert "time step" in info["physics_error"]
    with pytest.raises(PhysicsError, match="time step"):
        env.reset(seed=0)


@pytest.mark.parametrize(
    ("array", "value"),
    [("geom_size", -0.1), ("body_mass", -1.0), ("body_inertia", -1e-3)],
)
def test_a_size_below_zero_is_named_at_the_reset(array, value):
    env = wbc_suite.make("Lift", robots="Panda").unwrapped
    getattr(env.simulation.model, array)[3] = value
    with pytest.raises(PhysicsError, match=rf"{array} of \w+ '.+' is .*below 0"):
        env.reset(seed=0)


@pytest.mark.parametrize(
    ("array", "row", "value", "message"),
    [
        ("opt.gravity", 2, np.nan, "opt.gravity is .*nan.*, not finite"),
        ("opt.wind", 0, np.inf, "opt.wind is .*inf.*, not finite"),
        ("actuator_gainprm", (0, 0), np.nan, "actuator 'robot0_panda_joint1' is .*nan"),
        ("body_inertia", (3, 0), np.nan, "body_inertia of body .*nan.*, not finite"),
        ("dof_damping", 2, np.nan, "dof_damping of dof .* is nan, not finite"),
        ("jnt_range", 1, (1.0, -1.0), "jnt_range of jnt .* ends before it begins"),
        ("actuator_ctrlrange", 1, (1.0, -1.0), "actuator_ctrlrange .* ends before"),
    ],
)
def test_numbers_that_no_model_has_are_named_at_the_reset(array, row, value, message):
    env = wbc_suite.make("Lift", robots="Panda").unwrapped
    operator.attrgetter(array)(env.simulation.model)[row] = value
    with pytest.raises(PhysicsError, match=message):
        env.reset(seed=0)


@pytest.mark.parametrize(
    ("array", "row", "value"),
    [
        ("opt.gravity", 2, np.nan),
        ("body_mass", 3, -1.0),
        ("body_inertia", (3, 0), np.nan),
        ("geom_size", (3, 0), -0.1),
        ("jnt_range", 1, (1.0, -1.0)),
    ],
)
def test_numbers_that_no_model_has_end_the_episode_at_the_next_step(array, row, value):
    env = wbc_suite.make("Lift", robots="Panda").unwrapped
    env.reset(seed=0)
    operator.attrgetter(array)(env.simulation.model)[row] = value
    *_, terminated, _, info = env.step(env.hold_action)
    assert terminated
    assert array in info["physics_error"]


@pytest.mark.parametrize("gain", ["kp", "kd"])
def test_a_gain_that_is_no_number_is_named_at_the_reset(gain):
    env = wbc_suite.make("Lift", robots="Panda").unwrapped
    env.controllers[0].parts["right"].law.record[gain] = np.nan
    with pytest.raises(PhysicsError, match=f"'{gain}' of a control law is NaN"):
        env.reset(seed=0)


def test_an_object_takes_its_path_as_text_or_refuses_it(tmp_path):
    path = tmp_path / "a.xml"
    path.write_text("<mujoco/>")
    assert MjcfObject(name="a", path=str(path)).path == path
    with pytest.raises(DescriptionError, match="must be a path, not 3"):
        MjcfObject(name="a", path=3)  # type: ignore[arg-type]
