import numpy as np
import pytest
from textbook_laws import observe

from wbc_suite.control.ground.acceleration_limits import acceleration_limits
from wbc_suite.control.ground.physics import bind_physics
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.robot.mjcf_export import LONGEST_STEP, STOP_MARGIN

JOINTS = tuple(f"panda_joint{i}" for i in range(1, 8))


def joint_parts(**settings):
    part = {"type": "JOINT_POSITION", "input_type": "absolute", "kp": 900.0}
    return {"body_parts": {"right": part | settings}}


def run(panda, seconds):
    """Run and return positions and velocities of the arm, one row per step."""
    law = panda.controller.parts["right"].law
    rows = []
    for _ in range(round(seconds / panda.simulation.timestep)):
        panda.simulation.tick(1)
        data = panda.state.data
        rows.append((data.qpos[law.drives["qpos"]], data.qvel[law.drives["dof"]]))
    q, v = zip(*rows, strict=True)
    return np.array(q), np.array(v)


def as_plain_python(simulation):
    """Run the laws of a simulation without numba from now on."""
    simulation._runs_plain, simulation._needed = True, []


@pytest.fixture
def panda(alone):
    robot = alone("Panda", "BASIC", **joint_parts())
    robot.simulation.start()
    return robot


def test_joints_stop_at_their_limits_however_fast_they_come(panda):
    law = panda.controller.parts["right"].law
    law.keep_limits(panda.state)
    limits = [panda.robot.joint(j) for j in JOINTS]
    high = np.array([joint.range[1] for joint in limits])
    fastest = np.array([joint.velocity for joint in limits])
    law.aim(high + 1.0)  # a stiff law pulls through the stop
    q, v = run(panda, 4.0)
    assert (q <= high + 1e-3).all()
    assert np.abs(v).max(axis=0) == pytest.approx(fastest, abs=0.03)
    margin = np.minimum(STOP_MARGIN, LONGEST_STEP * fastest)
    assert q[-1] == pytest.approx(high - margin, abs=1e-3)


def test_a_joint_outside_its_limits_comes_back(panda):
    law = panda.controller.parts["right"].law
    law.keep_limits(panda.state)
    law.drives["position_max"][6] = panda.state.data.qpos[law.drives["qpos"][6]] - 0.3
    q, v = run(panda, 1.0)
    assert q[-1, 6] == pytest.approx(law.drives["position_max"][6], abs=1e-3)
    assert np.abs(v[:, 6]).max() <= law.drives["velocity_max"][6] + 1e-3


def test_the_window_lets_a_joint_brake_with_its_own_deceleration(panda):
    law = panda.controller.parts["right"].law
    law.keep_limits(panda.state)
    drives, data = law.drives, panda.state.data
    drives["deceleration"] = 2.0
    drives["position_max"] = data.qpos[drives["qpos"]] + 0.5
    drives["velocity_max"], drives["position_min"] = np.inf, -np.inf
    data.qvel[drives["dof"]] = np.sqrt(2 * 2.0 * 0.5 + (2.0 / 50) ** 2) - 2.0 / 50
    physics = bind_physics(panda.state.model, data)
    limits = np.array([acceleration_limits(physics, drive) for drive in drives])
    # On the profile: b u / (u + b / r), a little less than b.
    u = data.qvel[drives["dof"]]
    np.testing.assert_allclose(limits[:, 1], -2.0 * u / (u + 2.0 / 50), rtol=1e-12)
    assert (limits[:, 0] == -np.inf).all()


def test_the_observer_finds_a_constant_force_and_takes_it_away(panda):
    law = panda.controller.parts["right"].law
    law.record["observer"] = 30.0
    panda.state.data.qfrc_applied[law.drives["dof"][1]] = 8.0
    start = panda.state.data.qpos[law.drives["qpos"]].copy()
    q, _ = run(panda, 1.0)
    np.testing.assert_allclose(
        law.drives["disturbance"], [0, 8.0, 0, 0, 0, 0, 0], atol=1e-6
    )
    np.testing.assert_allclose(q[-1], start, atol=1e-8)
    law.reset(panda.state)
    assert not law.drives["disturbance"].any()


def test_the_observer_does_not_wind_up_while_a_motor_is_at_its_limit(panda):
    law = panda.controller.parts["right"].law
    law.record["observer"] = 30.0
    law.drives["command_min"] = -20.0  # less than gravity takes
    law.drives["command_max"] = 20.0
    run(panda, 0.2)
    assert np.abs(law.drives["disturbance"]).max() < 0.5
    observe(panda.state, [law])
    assert isinstance(law, JointLaw)


@pytest.mark.slow
def test_compiled_and_plain_observer_and_limits_agree(alone):
    ends = []
    for compiled in (True, False):
        robot = alone("Panda", "BASIC", **joint_parts())
        robot.simulation.start()
        if not compiled:
            as_plain_python(robot.simulation)
        law = robot.controller.parts["right"].law
        law.keep_limits(robot.state)
        law.record["observer"] = 30.0
        law.aim(robot.state.data.qpos[law.drives["qpos"]] + 2.0)
        robot.state.data.xfrc_applied[-1] = (3.0, 2.0, -10.0, 0.0, 0.5, 0.0)
        robot.simulation.tick(500)
        ends.append((robot.state.data.qpos.copy(), law.drives["disturbance"].copy()))
    for one, other in zip(*ends, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-10)
