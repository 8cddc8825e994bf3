import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from wbc_suite.scene import objects
from wbc_suite.scene.objects import ObjectState


def scene(*things):
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(1, 1, 1))
    for thing in things:
        thing.add_to(spec)
    model = spec.compile()
    return model, mujoco.MjData(model)


def test_a_resized_box_is_the_box_compiled_at_that_size():
    size, density = (0.03, 0.02, 0.05), 650.0
    model, data = scene(objects.box("b", (0.01, 0.02, 0.015)))
    ObjectState(model, data, "b").reshape(objects.box("b", size, density=density))
    wanted, _ = scene(objects.box("b", size, density=density))
    for field in (
        *("geom_size", "geom_aabb", "geom_rbound", "bvh_aabb", "body_mass"),
        *("body_inertia", "body_invweight0", "dof_invweight0"),
    ):
        ours, theirs = getattr(model, field)[1:], getattr(wanted, field)[1:]
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, err_msg=field)


def test_a_box_that_grew_touches_at_its_new_size():
    model, data = scene(objects.box("b", (0.01, 0.01, 0.01)))
    state = ObjectState(model, data, "b")
    state.reshape(objects.box("b", (0.02, 0.02, 0.02)))
    state.move((0.0, 0.0, 0.0199))
    mujoco.mj_forward(model, data)
    assert data.ncon == 4
    np.testing.assert_allclose(data.contact.dist, -1e-4, atol=1e-12)


@pytest.mark.parametrize(
    "thing",
    [
        objects.box("t", (0.03, 0.02, 0.05)),
        objects.ball("t", 0.04),
        objects.cylinder("t", 0.03, 0.05),
        objects.capsule("t", 0.03, 0.05),
        objects.hull("t", [(0, 0, 0, 0.02), (0.05, 0, 0, 0.01), (0, 0.03, 0.04, 0.0)]),
    ],
    ids=lambda thing: thing.parts[0].kind,
)
def test_extents_are_how_high_things_stand_on_a_plane(thing):
    model, data = scene(thing)
    state = ObjectState(model, data, "t")
    for seed in range(5):
        x, y, z, w = Rotation.random(rng=np.random.default_rng(seed)).as_quat()
        quat = (w, x, y, z)
        extent = state.extent(quat)
        for shift, touches in ((-1e-5, True), (1e-5, False)):
            state.move((0.2, 0.1, extent.bottom + shift), quat)
            mujoco.mj_forward(model, data)
            assert (data.ncon > 0) == touches
        opposite = tuple(np.array([-x, w, -z, y]))  # half a turn about x before
        assert state.extent(opposite).bottom == pytest.approx(extent.top, abs=1e-9)


def test_radius_holds_the_thing_however_it_is_turned():
    model, data = scene(objects.box("t", (0.03, 0.04, 0.05)))
    state = ObjectState(model, data, "t")
    assert state.extent().radius == pytest.approx(0.05, rel=2e-3)
    lying = state.extent((np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0))
    assert lying.radius == pytest.approx(np.hypot(0.05, 0.04), rel=2e-3)
    assert (lying.bottom, lying.top) == pytest.approx((0.03, 0.03))


def test_moving_leaves_it_at_rest():
    model, data = scene(objects.ball("t", 0.04))
    data.qvel[:] = 1.0
    state = ObjectState(model, data, "t")
    state.move((1.0, 2.0, 3.0), (0.0, 1.0, 0.0, 0.0))
    mujoco.mj_forward(model, data)
    np.testing.assert_array_equal(state.position, (1.0, 2.0, 3.0))
    np.testing.assert_allclose(state.rotation, np.diag([1.0, -1.0, -1.0]), atol=1e-15)
    assert not data.qvel.any()


def test_fixed_things_are_moved_in_the_model():
    thing = objects.box("t", (0.1, 0.1, 0.1)).fixed((0.0, 0.0, 1.0))
    model, data = scene(thing)
    state = ObjectState(model, data, "t")
    state.move((1.0, 2.0, 3.0))
    mujoco.mj_forward(model, data)
    np.testing.assert_array_equal(state.position, (1.0, 2.0, 3.0))
    assert model.nv == 0
    assert not state.is_free
