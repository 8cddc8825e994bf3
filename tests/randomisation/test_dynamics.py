"""Drawn masses, inertias and armatures act on every body alike."""

from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from wbc_suite.randomisation import Randomisation, draw_pattern

SCENE = """<mujoco><worldbody>
<body name="ball" pos="0 0 1"><freejoint/><geom size=".1" mass="2"/></body>
<body name="lump" pos="1 0 1"><freejoint/><geom size=".1" pos=".2 0 0" mass="3"/></body>
<body name="slider"><joint type="slide" axis="1 0 0" armature=".5"/>
<geom size=".1" mass="4"/></body>
<body name="arm" pos="3 0 0"><joint axis="0 1 0" armature=".2"/>
<geom size=".1" pos="0 0 -1" mass="1"/></body>
</worldbody></mujoco>"""
BODIES = ("ball", "lump", "slider", "arm")


def mass_matrix(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    columns = []
    for unit in np.eye(model.nv):
        column = np.empty(model.nv)
        mujoco.mj_mulM(model, data, column, unit)
        columns.append(column)
    return np.array(columns)


def scene():
    return mujoco.MjModel.from_xml_string(SCENE)


def drawn(**amounts):
    """Return a model with drawn values, and the randomisation that drew them."""
    model = scene()
    env = SimpleNamespace(
        simulation=SimpleNamespace(model=model, timestep=0.002), latency=0
    )
    bound = Randomisation(**amounts).bind(env)
    bound.apply(np.random.default_rng(4))
    return model, bound


def compiled_with(model):
    """Return the model that the compiler makes of the drawn masses and armatures."""
    spec = mujoco.MjSpec.from_string(SCENE)
    nominal = scene()
    for name in BODIES:
        body = spec.body(name)
        (geom,) = body.geoms
        before, after = nominal.body(name), model.body(name)
        body.explicitinertial = True
        body.mass = float(after.mass[0])
        body.ipos = nominal.body(name).ipos
        body.iquat = nominal.body(name).iquat
        body.inertia = after.inertia
        del before, geom
        for joint in body.joints:
            if joint.type != mujoco.mjtJoint.mjJNT_FREE:
                index = nominal.body(name).dofadr[0]
                joint.armature = float(model.dof_armature[index])
    return spec.compile()


@pytest.mark.parametrize(
    "amounts",
    [
        {"mass": 0.3},
        {"inertia": 0.3},
        {"armature": 0.3},
        {"mass": 0.3, "inertia": 0.2, "armature": 0.4},
    ],
    ids=lambda amounts: "+".join(amounts),
)
def test_the_mass_matrix_is_that_of_the_drawn_values(amounts):
    model, _ = drawn(**amounts)
    assert np.abs(mass_matrix(model) - mass_matrix(scene())).max() > 1e-4
    np.testing.assert_allclose(
        mass_matrix(model), mass_matrix(compiled_with(model)), rtol=1e-9, atol=1e-12
    )


@pytest.mark.parametrize("amount", ["mass", "inertia", "armature"])
def test_everything_is_nominal_again(amount):
    model, bound = drawn(**{amount: 0.3})
    bound.restore()
    np.testing.assert_array_equal(mass_matrix(model), mass_matrix(scene()))


def test_a_heavier_ball_is_pushed_less():
    model, _ = drawn(mass=0.5)
    factor = model.body("ball").mass[0] / 2.0
    assert abs(factor - 1.0) > 0.01
    data = mujoco.MjData(model)
    data.body("ball").xfrc_applied[0] = 1.0
    mujoco.mj_forward(model, data)
    assert data.qacc[0] == pytest.approx(1.0 / (2.0 * factor))


def test_the_same_generator_draws_the_same_scene():
    first, second = drawn(mass=0.3, friction=0.2), drawn(mass=0.3, friction=0.2)
    np.testing.assert_array_equal(first[0].body_mass, second[0].body_mass)
    np.testing.assert_array_equal(first[0].geom_friction, second[0].geom_friction)


@pytest.mark.parametrize("seed", range(8))
def test_patterns_have_two_colours_and_what_is_between(seed):
    picture = draw_pattern(24, 36, np.random.default_rng(seed))
    assert picture.shape == (24, 36, 3)
    assert picture.dtype == np.uint8
    colors = picture.reshape(-1, 3).astype(float)
    spread = colors - colors.mean(axis=0)
    if spread.any():  # not the plain one: all on one line in colour space
        _, sizes, _ = np.linalg.svd(spread, full_matrices=False)
        assert sizes[1] < 0.05 * sizes[0] + 30.0


def test_all_kinds_of_patterns_are_drawn():
    spreads = [
        draw_pattern(32, 32, np.random.default_rng(seed)).std() for seed in range(30)
    ]
    assert min(spreads) < 80.0
    kinds = {
        len(
            np.unique(
                draw_pattern(32, 32, np.random.default_rng(s)).reshape(-1, 3), axis=0
            )
        )
        for s in range(30)
    }
    assert 1 in kinds  # plain
    assert 2 in kinds  # chequered
    assert max(kinds) > 10  # graded or noisy
