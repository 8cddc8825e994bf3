"""Bodies that are hidden from the broadphase while far miss no contact.

Nor does what is fixed, which MuJoCo lets sleep meanwhile.
"""

import mujoco
import numpy as np
import pytest

from wbc_suite.control.loop import bind_haste
from wbc_suite.control.loop.haste import Haste, begin_haste, end_haste
from wbc_suite.control.loop.neighbours import (
    SKIN,
    between_balls,
    from_fixed,
    hide_far_bodies,
)
from wbc_suite.envs.simulation import Simulation

SHAPES = (
    (mujoco.mjtGeom.mjGEOM_SPHERE, 1),
    (mujoco.mjtGeom.mjGEOM_CAPSULE, 2),
    (mujoco.mjtGeom.mjGEOM_BOX, 3),
    (mujoco.mjtGeom.mjGEOM_CYLINDER, 2),
    (mujoco.mjtGeom.mjGEOM_ELLIPSOID, 3),
)
JOINTS = (
    mujoco.mjtJoint.mjJNT_HINGE,
    mujoco.mjtJoint.mjJNT_SLIDE,
    mujoco.mjtJoint.mjJNT_BALL,
)
TICKS, STEPS = 12, 25


def some_geom(rng, body, *, drawn=False):
    kind, count = SHAPES[rng.integers(len(SHAPES))]
    size = np.zeros(3)
    size[:count] = rng.uniform(0.03, 0.12, count)
    margin = float(rng.choice([0.0, 0.0, 0.02]))
    geom = body.add_geom(type=kind, size=size, pos=rng.normal(0.0, 0.05, 3))
    geom.quat, geom.margin = rng.normal(size=4), margin
    if drawn:
        geom.contype = geom.conaffinity = 0


def room(seed):
    """Return flails of all joints, things that fly, walls and a tilted floor."""
    rng = np.random.default_rng(seed)
    spec = mujoco.MjSpec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    tilt = (1.0, *rng.normal(0.0, 0.1, 2), 0.0)
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    spec.worldbody.add_geom(type=plane, size=(0.0, 0.0, 1.0), quat=tilt)
    for _ in range(4):
        wall = spec.worldbody.add_body(pos=rng.uniform((-1, -1, 0), (1, 1, 1)))
        wall.quat = rng.normal(size=4)
        some_geom(rng, wall)
    hung = spec.worldbody.add_body(pos=(0.0, 0.0, 0.6), mocap=True)
    some_geom(rng, hung)
    for _ in range(2):
        link = spec.worldbody.add_body(pos=rng.uniform((-1, -1, 0.8), (1, 1, 1.6)))
        for _ in range(4):
            joint = link.add_joint(
                type=JOINTS[rng.integers(3)], armature=0.1, damping=(0.05, 0, 0)
            )
            joint.axis, joint.pos = rng.normal(size=3), rng.normal(0.0, 0.02, 3)
            some_geom(rng, link, drawn=True)
            some_geom(rng, link)
            link = link.add_body(pos=rng.normal(0.0, 0.2, 3))
        some_geom(rng, link)
        link.add_joint(axis=rng.normal(size=3))
    for _ in range(8):
        thing = spec.worldbody.add_body(pos=rng.uniform((-2, -2, 0.5), (2, 2, 2)))
        thing.add_freejoint()
        for _ in range(rng.integers(1, 3)):
            some_geom(rng, thing)
    return spec.compile(), rng


def thrown(seed, *, compiled):
    """Throw everything about at up to 20 m/s; return the states and the contacts."""
    model, rng = room(seed)
    data = mujoco.MjData(model)
    data.qvel[:] = rng.normal(0.0, rng.choice([0.3, 2.0, 5.0]), model.nv)
    simulation = Simulation(model, data, compiled=compiled)
    simulation.start()
    states, touching, near = [], [], []
    for _ in range(TICKS):
        model.body_pos[1:5] += rng.normal(0.0, 0.02, (4, 3))  # the walls
        data.mocap_pos[:] += rng.normal(0.0, 0.02, 3)
        simulation.tick(STEPS)
        poses = data.geom_xpos.ravel(), data.geom_xmat.ravel()
        states.append(np.concatenate([data.qpos, data.qvel, *poses]))
        touching += [data.contact.geom.copy(), data.contact.dist.copy()]
        near.append(simulation._haste[Haste.NEAR].mean())
    return np.array(states), touching, np.array(near)


@pytest.mark.parametrize("seed", range(40))
def test_no_contact_is_missed(seed):
    """Bit for bit the states and contacts of MuJoCo's own steps."""
    expected, contacts, _ = thrown(seed, compiled=False)
    states, touching, near = thrown(seed, compiled=True)
    np.testing.assert_array_equal(states, expected)
    for own, other in zip(touching, contacts, strict=True):
        np.testing.assert_array_equal(own, other)
    assert near.min() < 1.0  # some were hidden
    assert sum(map(len, contacts))


WOUND = """
<mujoco>
  <worldbody>
    <site name="above" pos="-0.2 0 1"/>
    <body pos="0 0 0.8">
      <joint axis="0 1 0"/>
      <geom name="reel" type="cylinder" size="0.05 0.02" contype="0" conaffinity="0"
            pos="0.02 0 0" zaxis="0 1 0"/>
      <geom type="sphere" size="0.02" pos="0 0 -0.2"/>
    </body>
    <body pos="0.2 0 0.7">
      <freejoint/>
      <geom type="sphere" size="0.03"/>
      <site name="below"/>
    </body>
  </worldbody>
  <tendon>
    <spatial stiffness="40" springlength="0.3">
      <site site="above"/>
      <geom geom="reel"/>
      <site site="below"/>
    </spatial>
  </tendon>
</mujoco>
"""


def test_tendons_wind_around_what_does_not_collide():
    expected, found = (
        after_200_steps(mujoco.MjModel.from_xml_string(WOUND), compiled=c)
        for c in (False, True)
    )
    np.testing.assert_array_equal(found, expected)
    assert abs(found).max() > 0.1  # it moved


def after_200_steps(model, *, compiled, change=None):
    """Return positions; `change` is done to the model when the loop is bound."""
    data = mujoco.MjData(model)
    simulation = Simulation(model, data, compiled=compiled)
    if change is not None:
        change(model)
    simulation.start()
    for _ in range(8):
        simulation.tick(STEPS)
    return data.qpos.copy()


def ghost_that_meets(pairs):
    """Return two balls that collide only as a pair, one of them behind a wall."""
    spec = mujoco.MjSpec()
    for k, name in enumerate("ab"):
        ball = spec.worldbody.add_body(pos=(0.0, 0.0, 0.5 + 0.5 * k))
        ball.add_geom(size=(0.05, 0.0, 0.0), pos=(0.4, 0.0, 0.0))
        ghost = ball.add_geom(name=name, size=(0.1, 0.0, 0.0))
        ghost.contype = ghost.conaffinity = 0
        if k:
            ball.add_freejoint()
    if pairs:
        spec.add_pair(geomname1="a", geomname2="b")
    return spec.compile()


def test_pairs_that_somebody_wrote_down_collide():
    expected, found, without = (
        after_200_steps(ghost_that_meets(pairs), compiled=compiled)
        for pairs, compiled in ((True, False), (True, True), (False, False))
    )
    np.testing.assert_array_equal(found, expected)
    assert abs(found - without).max() > 0.1


@pytest.mark.parametrize("seed", range(8))
def test_switches_that_are_turned_later_count(seed):
    """Children begin to collide with their parents; margins prevail over all others."""

    def children_collide(model):
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_FILTERPARENT

    def wide_margins(model):
        model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_OVERRIDE
        model.opt.o_margin = 0.3

    for change in (children_collide, wide_margins):
        expected, found = (
            after_200_steps(room(seed)[0], compiled=c, change=change)
            for c in (False, True)
        )
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("seed", range(10))
def test_distances_are_never_more_than_those_of_the_shapes(seed):
    """MuJoCo's own distance of each pair of shapes; sometimes they are as far."""
    model, _ = room(seed)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    table = bind_haste(model, data).table
    solid = np.flatnonzero(model.geom_contype)
    fixed = model.body_weldid[model.geom_bodyid] == 0
    slack = []
    for g in solid:
        for h in solid[~fixed[solid]]:
            if g == h or (g == 0 and data.geom_xpos[h, 2] < 0.3):
                continue  # what reaches into the floor has no distance
            margin = model.geom_margin[g] + model.geom_margin[h]
            far = mujoco.mj_geomDistance(model, data, g, h, 9.0, None) - margin
            found = between_balls(table, g, h)
            if fixed[g]:
                found = max(found, from_fixed(table, g, h))
            assert found <= max(far, 0.0) + 1e-9
            slack.append(far - found)
    assert min(slack) < 0.02


@pytest.mark.parametrize("seed", range(10))
def test_no_joint_has_a_longer_lever(seed):
    """In other postures too, of which slides are up to `SKIN` further on."""
    model, rng = room(seed)
    data = mujoco.MjData(model)
    slides = model.jnt_qposadr[model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE]
    data.qpos[slides] = 1.0
    mujoco.mj_kinematics(model, data)
    table = bind_haste(model, data)
    begin_haste(table.table)
    hide_far_bodies(table.table)
    end_haste(table.table)
    levers, longest = table[Haste.LEVERS].copy(), np.zeros(model.nv)
    jacobian = np.zeros((3, model.nv))
    for _ in range(300):
        data.qpos[:] = rng.uniform(-np.pi, np.pi, model.nq)
        data.qpos[slides] = 1.0 + rng.uniform(-SKIN, SKIN, len(slides))
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        for geom in np.flatnonzero(model.geom_contype):
            point, body = data.geom_xpos[geom], model.geom_bodyid[geom]
            mujoco.mj_jac(model, data, jacobian, None, point, body)
            longest = np.maximum(longest, np.linalg.norm(jacobian, axis=0))
    assert np.all(longest <= levers + 1e-9)
    assert np.median(longest / levers) > 0.3  # nor are they much too long
