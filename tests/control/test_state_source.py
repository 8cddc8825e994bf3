"""What WHOLE_BODY_ID believes of its robot: delay, noise, and an estimated root."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.control import load_composite_controller_config
from wbc_suite.errors import ConfigError

NOISY = {
    "position_noise": 5e-4,
    "velocity_noise": 0.05,
    "gyro_noise": 0.01,
    "acceleration_noise": 0.1,
}


class Sensing:
    """A robot under WHOLE_BODY_ID that knows its state from sensors."""

    def __init__(self, alone, name, **sensors):
        found = alone(name, "WHOLE_BODY_ID", sensors=sensors)
        self.simulation, self.controller = found.simulation, found.controller
        self.data, self.body = found.state.data, found.controller.dynamics
        self.simulation.start()
        (self.source,) = self.simulation._sources
        self.link = int(self.body.state["body"][0])

    def walk(self, seconds, speed=0.0):
        layout = self.controller.layout
        hold = self.controller.hold_action
        action = layout.pack({"walk": [speed, 0.0, 0.0]}, base=hold)
        states = []
        for _ in range(round(seconds / 0.02)):
            self.controller.set_goal(action, 0.02)
            self.simulation.tick(10)
            states.append((self.data.qpos.copy(), self.data.qvel.copy()))
        return states

    @property
    def fell(self):
        return self.data.xmat[self.link][8] < 0.6


@pytest.mark.slow
def test_readings_without_noise_are_those_of_the_delay_before(alone):
    robot = Sensing(alone, "Spot", delay=0.02)
    before, _ = robot.walk(0.5, 0.5)[-2:]
    # The last reading was taken before the last of ten steps, and is ten steps old.
    robot.simulation.tick(1)
    np.testing.assert_allclose(robot.source.qpos[7:], before[0][7:], atol=1e-12)
    np.testing.assert_allclose(robot.source.qvel[6:], before[1][6:], atol=1e-12)


@pytest.mark.slow
def test_noise_has_the_deviation_that_is_asked_for(alone):
    robot = Sensing(alone, "Spot", velocity_noise=0.05)
    differences = []
    for _ in range(200):
        before = robot.data.qvel[6:].copy()
        robot.simulation.tick(1)
        differences.append(robot.source.qvel[6:] - before)
    assert np.std(differences) == pytest.approx(0.05, rel=0.05)
    np.testing.assert_array_equal(robot.source.noise[:16], 0.0)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "speed"), [("Spot", 0.8), ("GR1FreeBody", 0.4)])
def test_robot_walks_by_an_estimate_of_its_root(alone, name, speed):
    noise = NOISY if name == "Spot" else {key: 0.2 * x for key, x in NOISY.items()}
    robot = Sensing(alone, name, source="estimator", **noise)
    start = robot.data.xpos[robot.link].copy()
    robot.walk(6.0, speed)
    assert not robot.fell
    way = robot.data.xpos[robot.link] - start
    assert way[0] > 0.65 * speed * 6.0
    estimate, dof = robot.source.estimate, slice(0, 3)
    true = robot.data.xmat[robot.link].reshape(3, 3)
    assert np.linalg.norm(estimate.p - robot.data.qpos[:3]) < 0.03
    assert np.linalg.norm(estimate.v - robot.data.qvel[dof]) < 0.05
    assert np.linalg.norm(pin.log3(estimate.R.T @ true)) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["Spot", "GR1FreeBody"])
def test_robot_walks_by_delayed_and_noisy_readings(alone, name, seed):
    robot = Sensing(alone, name, delay=0.02, velocity_noise=0.05, seed=seed)
    robot.walk(4.0, 0.3)
    assert not robot.fell
    assert robot.data.qpos[0] > 0.5


@pytest.mark.slow
def test_a_step_takes_one_reading_also_where_python_solves_the_qp(alone):
    robot = Sensing(alone, "GR1FreeBody", source="estimator", gyro_noise=0.02)
    steps = 10 * len(robot.walk(3.0, 0.4))
    assert robot.body.state["unsolved"][0] > 0
    assert robot.source.state["count"][0] == steps


@pytest.mark.slow
def test_plain_python_believes_what_the_loop_does(alone):
    compiled = Sensing(alone, "Spot", source="estimator", **NOISY)
    plain = Sensing(alone, "Spot", source="estimator", **NOISY)
    plain.simulation = type(plain.simulation)(
        plain.simulation.model,
        plain.data,
        plain.simulation.pairs,
        compiled=False,
    )
    plain.simulation.start()
    (source,) = plain.simulation._sources
    for robot in (compiled, plain):
        robot.simulation.tick(3)
    np.testing.assert_allclose(source.qpos, compiled.source.qpos, atol=1e-9)
    np.testing.assert_allclose(plain.data.ctrl, compiled.data.ctrl, atol=1e-6)


@pytest.mark.slow
def test_a_reset_begins_with_the_same_noise_at_the_true_state(alone):
    robot = Sensing(alone, "Spot", source="estimator", **NOISY)
    start = robot.data.qpos.copy()
    first = robot.walk(0.1)[-1]
    robot.data.qpos[:], robot.data.qvel[:] = start, 0.0
    robot.data.qacc_warmstart[:] = 0.0
    robot.simulation.start()
    np.testing.assert_array_equal(robot.source.estimate.p, start[:3])
    np.testing.assert_allclose(robot.walk(0.1)[-1][0], first[0], atol=1e-6)


@pytest.mark.parametrize(
    "sensors",
    [{"source": "gps"}, {"delay": -1.0}, {"velocity_noise": float("nan")}, {"x": 1}],
)
def test_wrong_sensors_are_refused_by_name(sensors):
    config = load_composite_controller_config("WHOLE_BODY_ID", "Spot")
    with pytest.raises(ConfigError, match="sensors"):
        load_composite_controller_config(config | {"sensors": sensors}, "Spot")
