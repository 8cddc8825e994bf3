"""A law written outside the package runs in the compiled loop, and in plain Python."""

import warnings

import numpy as np
import pytest

from wbc_suite.compiling import compiled
from wbc_suite.control.ground.records import LawKind
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.control.law.law import LAWS, Law, law_kernel, law_kind, register_law
from wbc_suite.control.run.kernel_table import bind_kernels
from wbc_suite.envs import Simulation
from wbc_suite.errors import ConfigError


@compiled
def oscillator(physics, law, drives):
    """Write `-k (q - q*)` of each joint, k = parameters[0]."""
    for j in range(law.first, law.last):
        drive = drives[j]
        error = drive.position - physics.qpos[drive.qpos]
        physics.acceleration[drive.dof] = law.parameters[0] * error


@compiled
def brake(physics, law, drives):
    """Write `-v / parameters[0]` of each joint."""
    for j in range(law.first, law.last):
        dof = drives[j].dof
        physics.acceleration[dof] = -physics.qvel[dof] / law.parameters[0]


@pytest.fixture(autouse=True)
def laws(forget):
    forget(LAWS, "OSCILLATOR", "BRAKE")
    register_law("OSCILLATOR", oscillator)
    register_law("BRAKE", brake)


def test_a_replaced_law_runs_in_place_of_the_first():
    kind = law_kind("BRAKE")
    assert law_kernel(kind) is brake
    register_law("brake", oscillator, replace=True)
    assert law_kind("BRAKE") == kind
    assert law_kernel(kind) is oscillator


class OwnController:
    """A controller that is nothing but laws."""

    def __init__(self, *laws):
        self.laws = laws

    def prepare(self, state):
        return 1 << 30


def simulated(alone, *, is_compiled, steps):
    """Return joint positions of a Panda's arm after each step."""
    robot = alone("Panda", "BASIC", body_parts={"right": {"type": "JOINT_TORQUE"}})
    state, part = robot.state, robot.controller.parts["right"]
    rest = [law for law in robot.controller.laws if law is not part.law]
    joints = part.law.joints
    swing = Law("OSCILLATOR", state, joints[:1])
    swing.record["parameters"][0, 0] = 100.0
    stop = Law("BRAKE", state, joints[1:])
    stop.record["parameters"][0, 0] = 0.01
    pairs = [(state, OwnController(swing, stop, *rest))]
    simulation = Simulation(state.model, state.data, pairs, compiled=is_compiled)
    start = state.data.qpos[swing.drives["qpos"]]
    swing.aim(start + 0.1)
    q = []
    for _ in range(steps):
        simulation.tick(1)
        q.append(state.data.qpos[swing.drives["qpos"][0]] - start[0])
    return np.array(q), simulation.timestep


def test_a_registered_law_moves_joints_as_its_formula_says(alone):
    """`q'' = 100 (0.1 - q)` from rest: `q = 0.1 (1 - cos 10 t)`."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        q, dt = simulated(alone, is_compiled=True, steps=300)
    t = dt * np.arange(1, 301)
    np.testing.assert_allclose(q, 0.1 * (1.0 - np.cos(10.0 * t)), atol=2e-3)
    assert np.ptp(q) > 0.15


@pytest.mark.slow
def test_a_registered_law_runs_as_plain_python(alone):
    compiled_q, _ = simulated(alone, is_compiled=True, steps=20)
    plain_q, _ = simulated(alone, is_compiled=False, steps=20)
    np.testing.assert_allclose(plain_q, compiled_q, atol=1e-12)


def test_a_law_has_one_kind():
    assert law_kind("brake") > law_kind("OSCILLATOR") >= LawKind.CUSTOM
    with pytest.raises(ConfigError, match="law named 'BRAKE' exists already"):
        register_law("brake", oscillator)


def test_joint_limits_hold_for_a_registered_law(alone):
    """The loop clips the accelerations of users' laws as it does ours."""
    robot = alone("Panda", "BASIC", body_parts={"right": {"type": "JOINT_TORQUE"}})
    state, part = robot.state, robot.controller.parts["right"]
    rest = [law for law in robot.controller.laws if law is not part.law]
    joints = part.law.joints
    swing = Law("OSCILLATOR", state, joints[:1])
    hold = JointLaw(state, joints[1:], kp=400.0, kd=40.0)
    swing.keep_limits(state)
    swing.record["parameters"][0, 0] = 100.0
    pairs = [(state, OwnController(swing, hold, *rest))]
    simulation = Simulation(state.model, state.data, pairs)
    hold.aim(state.data.qpos[hold.drives["qpos"]])
    swing.aim(state.data.qpos[swing.drives["qpos"]] + 3.0)
    fastest = 0.0
    for _ in range(500):
        simulation.tick(1)
        fastest = max(fastest, abs(float(state.data.qvel[swing.drives["dof"][0]])))
    velocity_max = float(swing.drives["velocity_max"][0])
    assert 0.9 * velocity_max < fastest < 1.02 * velocity_max


def test_kernels_are_bound_again_only_where_laws_change(alone, monkeypatch):
    robot, bound = alone("Panda", "BASIC"), []

    def bind(loop, **named):
        bound.append(loop.laws["kind"].tolist())
        return bind_kernels(loop, **named)

    monkeypatch.setattr("wbc_suite.envs.simulation.bind_kernels", bind)
    state = robot.state
    simulation = Simulation(state.model, state.data, [(state, robot.controller)])
    simulation.start()
    for _ in range(3):
        simulation.tick(5)
    assert len(bound) == 1
