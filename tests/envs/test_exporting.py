"""Exported models are what we simulate, for engines that take plain MuJoCo models."""

import mujoco
import numpy as np
import pytest
from mujoco import rollout

import wbc_suite

AUTORESET = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)


@pytest.fixture(scope="module")
def env():
    env = wbc_suite.make("Lift")
    env.reset(seed=0)
    return env.unwrapped


def test_the_model_is_a_copy_with_the_automatic_reset(env):
    model, own = wbc_suite.export_model(env), env.simulation.model
    assert own.opt.disableflags & AUTORESET
    assert not model.opt.disableflags & AUTORESET
    np.testing.assert_array_equal(model.geom_size, own.geom_size)
    np.testing.assert_array_equal(model.body_mass, own.body_mass)
    model.body_mass[:] = 0.0
    assert own.body_mass.sum() > 1.0


def test_rollout_gives_the_states_of_mujoco(env):
    model = wbc_suite.export_model(env)
    data = mujoco.MjData(model)
    data.qpos[:] = env.simulation.data.qpos
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.empty(mujoco.mj_stateSize(model, full))
    mujoco.mj_getState(model, data, start, full)
    control = np.zeros((1, 20, model.nu))
    states, _ = rollout.rollout(model, [mujoco.MjData(model)], start[None], control)
    for _ in range(20):
        mujoco.mj_step(model, data)
    q = slice(1, 1 + model.nq)
    np.testing.assert_allclose(states[0, -1, q], data.qpos, atol=1e-12)


@pytest.mark.parametrize("benchmark", ["Lift", "PickPlaceCan", "NutAssemblyRound"])
def test_accelerator_has_no_solid_cylinders_and_keeps_masses(benchmark):
    env = wbc_suite.make(benchmark)
    env.reset(seed=1)
    exact = wbc_suite.export_model(env)
    model = wbc_suite.export_model(env, variant="accelerator")
    solid = (model.geom_contype | model.geom_conaffinity) > 0
    assert not (model.geom_type[solid] == mujoco.mjtGeom.mjGEOM_CYLINDER).any()
    np.testing.assert_array_equal(model.body_inertia, exact.body_inertia)
    changed = np.flatnonzero(model.geom_type != exact.geom_type)
    for geom in changed:
        radius, half, _ = exact.geom_size[geom]
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE:
            assert model.geom_size[geom, :2].sum() == pytest.approx(half)
        else:
            area = 4.0 * model.geom_size[geom, 0] * model.geom_size[geom, 1]
            assert area == pytest.approx(np.pi * radius**2)
            assert model.geom_size[geom, 2] == half


def test_accelerator_holds_still_as_the_exact_model_does(env):
    ends = []
    for variant in ("exact", "accelerator"):
        model = wbc_suite.export_model(env, variant=variant)
        data = mujoco.MjData(model)
        data.qpos[:] = env.simulation.data.qpos
        mujoco.mj_forward(model, data)
        for _ in range(50):
            data.ctrl[:] = 0.0
            mujoco.mj_step(model, data)
        ends.append(data.qpos[:3].copy())  # the cube on the table
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-3)


def test_accelerator_damps_joints_as_servos_below_their_limit_do():
    env = wbc_suite.make("Lift", robots="GR1")
    env.reset(seed=0)
    forces = []
    for variant in ("exact", "accelerator"):
        model = wbc_suite.export_model(env, variant=variant)
        servos = model.actuator_biastype == mujoco.mjtBias.mjBIAS_AFFINE
        damped = servos & (model.actuator_biasprm[:, 2] != 0.0)
        assert damped.sum() == (12 if variant == "exact" else 0)
        data = mujoco.MjData(model)
        data.qpos[:] = env.simulation.data.qpos
        data.qvel[:] = 0.1
        mujoco.mj_forward(model, data)
        data.ctrl[:] = data.actuator_length * servos
        mujoco.mj_forward(model, data)
        assert (abs(data.actuator_force) < model.actuator_forcerange[:, 1]).all()
        forces.append(data.qfrc_actuator + data.qfrc_passive)
    np.testing.assert_allclose(*forces, atol=1e-12)
    assert abs(forces[0]).max() > 0.01


@pytest.mark.parametrize(
    ("arguments", "mode"),
    [
        ({"has_renderer": True}, "human"),
        ({"has_renderer": False, "has_offscreen_renderer": True}, "rgb_array"),
        ({"has_offscreen_renderer": True, "render_mode": None}, None),
        ({"has_renderer": False, "has_offscreen_renderer": False}, None),
    ],
)
def test_robosuites_renderer_arguments_are_render_modes(arguments, mode):
    from wbc_suite.envs.config import parse_env_config

    assert parse_env_config({"robots": "Panda", **arguments}).render_mode == mode
