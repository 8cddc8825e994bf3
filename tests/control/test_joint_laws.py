"""Laws in joint space: kernels against NumPy, and against Pinocchio."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from textbook_laws import commands, kernel_commands

from wbc_suite.catalogue import Catalogue
from wbc_suite.control.robot_parts import parts_of
from wbc_suite.robot import load_robot

ROBOTS = Catalogue().names("robots")
FAST = ["panda", "tiago"]
STATES = 1000


def mixed_parts(robot):
    """Return parts with every kind of joint law in turn."""
    kinds = ["JOINT_VELOCITY", "JOINT_TORQUE", "JOINT_POSITION"]
    parts = {
        name: {"type": kinds[k % 3], "interpolation": "linear"}
        for k, name in enumerate(parts_of(robot))
    }
    if "base" in parts:
        parts["base"] = {"type": "BASE_VELOCITY"}
    return {"body_parts": parts, "may_fall": True}


def one_kind(robot, kind):
    parts = {name: {"type": kind} for name in parts_of(robot)}
    parts.pop("base", None)
    return {"body_parts": parts, "may_fall": True}


def draw_state(state, rng):
    """Put the whole scene into a random state."""
    model, data = state.model, state.data
    mujoco.mj_resetData(model, data)
    for j in range(model.njnt):
        place = model.jnt_qposadr[j]
        if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE:
            turn = rng.normal(size=4)
            data.qpos[place : place + 3] = rng.normal(size=3)
            data.qpos[place + 3 : place + 7] = turn / np.linalg.norm(turn)
        else:
            low, high = model.jnt_range[j] if model.jnt_limited[j] else (-3.0, 3.0)
            data.qpos[place] = rng.uniform(low, high)
    data.qvel[:] = rng.normal(size=model.nv)
    mujoco.mj_step1(model, data)


def draw_targets(laws, drives, state, rng):
    """Give all laws random records: targets, gains, limits, times."""
    count = len(drives)
    measured = state.data.qpos[drives["qpos"]]
    drives["position"] = measured + 0.3 * rng.normal(size=count)
    drives["velocity"] = rng.normal(size=count)
    drives["acceleration"] = rng.normal(size=count)
    drives["jerk"] = 20.0 * rng.normal(size=count)
    drives["kp"] = rng.uniform(0.0, 900.0, size=count)
    drives["kd"] = rng.uniform(0.0, 60.0, size=count)
    drives["correction_max"] = rng.choice([np.inf, 5.0], size=count)
    drives["windup_max"] = rng.choice([np.inf, 0.1], size=count)
    drives["position_min"] = rng.choice([-np.inf, -1.0], size=count)
    drives["position_max"] = rng.choice([np.inf, 1.0], size=count)
    laws["since"] = rng.uniform(0.0, 0.1, size=len(laws))
    laws["duration"] = rng.choice([np.inf, 0.05], size=len(laws))
    laws["compensation"] = rng.choice([0.0, 1.0], size=len(laws))


@pytest.mark.sample(10)
@pytest.mark.parametrize(
    "name",
    [r if r in FAST else pytest.param(r, marks=pytest.mark.slow) for r in ROBOTS],
)
def test_kernels_equal_the_formulas(alone, name):
    robot = load_robot(name)
    rig = alone(robot, "BASIC", **mixed_parts(robot))
    state, simulation = rig.state, rig.simulation
    laws, drives = simulation._laws, simulation._drives
    rng = np.random.default_rng(4)
    count = STATES if name not in FAST else STATES // 5
    for _ in range(count):
        draw_state(state, rng)
        draw_targets(laws, drives, state, rng)
        records = laws.copy(), drives.copy()
        plain = commands(state, rig.controller.laws)
        moved = drives["position"].copy()
        laws[:], drives[:] = records
        compiled = kernel_commands(simulation, state)
        np.testing.assert_allclose(compiled, plain, rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(drives["position"], moved, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    "name",
    [r if r in FAST else pytest.param(r, marks=pytest.mark.slow) for r in ROBOTS],
)
def test_joint_law_is_inverse_dynamics_by_pinocchio(alone, name):
    robot = load_robot(name)
    rig = alone(robot, "BASIC", **one_kind(robot, "JOINT_POSITION"))
    state, law_drives = rig.state, rig.simulation._drives
    model = robot.to_pinocchio()
    law_drives["command_min"], law_drives["command_max"] = -np.inf, np.inf
    law_drives["position_min"], law_drives["position_max"] = -np.inf, np.inf
    law_drives["velocity_max"] = np.inf
    rng = np.random.default_rng(5)
    for _ in range(20):
        draw_state(state, rng)
        for law in rig.controller.laws:
            aim = state.data.qpos[law.drives["qpos"]] + rng.normal(size=len(law.joints))
            law.aim(aim)
        tau = kernel_commands(rig.simulation, state)
        asked = np.zeros(state.model.nv)
        for law in rig.controller.laws:
            if law.record["kind"][0] == 0:
                d = law.drives
                error = d["position"] - state.data.qpos[d["qpos"]]
                rate = state.data.qvel[d["dof"]]
                asked[d["dof"]] = d["kp"] * error - d["kd"] * rate
        qpos, qvel = state.data.qpos, state.data.qvel
        acceleration = state.conversion.a_to_pinocchio(qpos, qvel, asked)
        force = pin.rnea(model, model.createData(), state.q, state.v, acceleration)
        force = state.conversion.tau_to_mujoco(qpos, force) - state.data.qfrc_passive
        for law in rig.controller.laws:
            if law.record["kind"][0] == 0:
                np.testing.assert_allclose(
                    tau[law.outputs], force[law.drives["dof"]], rtol=1e-8, atol=1e-8
                )


def test_torque_law_adds_gravity_and_coriolis_by_pinocchio(alone):
    robot = load_robot("Panda")
    rig = alone(robot, "BASIC", body_parts={"right": {"type": "JOINT_TORQUE"}})
    state, law = rig.state, rig.controller.parts["right"].law
    law.drives["command_min"], law.drives["command_max"] = -np.inf, np.inf
    model = robot.to_pinocchio()
    rng = np.random.default_rng(6)
    for compensation in (1.0, 0.0):
        law.record["compensation"] = compensation
        draw_state(state, rng)
        wanted = rng.normal(size=7)
        law.aim(wanted)
        tau = kernel_commands(rig.simulation, state)[law.outputs]
        force = pin.nonLinearEffects(model, model.createData(), state.q, state.v)
        carried = compensation * force[law.drives["dof"]]
        np.testing.assert_allclose(tau, wanted + carried, atol=1e-8)
