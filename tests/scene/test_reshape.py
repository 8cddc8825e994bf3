"""An object that is reshaped is the object compiled with those sizes."""

import mujoco
import numpy as np
import pytest

from wbc_suite.robot.shapes import Interval
from wbc_suite.scene.objects import ObjectState, SceneObject, box, cylinder, hammer
from wbc_suite.scene.placement import Placed, Region, UniformSampler

FLOOR = """<mujoco><worldbody><geom name="floor" type="plane" size="2 2 .1"/>
</worldbody></mujoco>"""


def scene(*items: SceneObject):
    spec = mujoco.MjSpec.from_string(FLOOR)
    for item in items:
        item.add_to(spec)
    model = spec.compile()
    return model, mujoco.MjData(model)


def touching(model, data):
    """Return contacts and accelerations of an object that lies in the floor by 1 mm."""
    model.opt.tolerance, model.opt.iterations = 0.0, 500  # to the solver's end
    extent = ObjectState(model, data, "x").extent((0.5, 0.5, 0.5, 0.5))
    data.joint("x_joint").qpos[:] = 0.1, 0.2, extent.bottom - 1e-3, 0.5, 0.5, 0.5, 0.5
    data.joint("before_joint").qpos[:3] = 1.0, 1.0, 2.0
    mujoco.mj_forward(model, data)
    return data.contact.dist.copy(), data.contact.pos.copy(), data.qacc.copy()


PAIRS = {
    "hammer": (
        hammer("x"),
        hammer("x", handle_radius=0.02, handle_length=0.25, head_half_size=0.03),
    ),
    "cylinder": (cylinder("x", 0.03, 0.1), cylinder("x", 0.05, 0.05)),
    "box": (box("x", (0.02, 0.02, 0.02)), box("x", (0.05, 0.03, 0.04))),
}


@pytest.mark.parametrize("name", PAIRS)
def test_a_reshaped_object_touches_as_the_compiled_one(name):
    first, second = PAIRS[name]
    model, data = scene(box("before", (0.1, 0.1, 0.1)), first)
    ObjectState(model, data, "x").reshape(second)
    reshaped = touching(model, data)
    expected = touching(*scene(box("before", (0.1, 0.1, 0.1)), second))
    assert len(reshaped[0])
    for found, wanted in zip(reshaped, expected, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("name", PAIRS)
def test_every_number_of_the_model_is_the_compilers(name):
    first, second = PAIRS[name]
    model, data = scene(first, box("after", (0.1, 0.1, 0.1)))
    ObjectState(model, data, "x").reshape(second)
    expected, _ = scene(second, box("after", (0.1, 0.1, 0.1)))
    for field in (
        *("geom_size", "geom_pos", "geom_quat", "geom_rbound", "geom_aabb"),
        *("body_mass", "body_inertia", "body_ipos", "body_iquat"),
        *("body_invweight0", "dof_invweight0", "site_pos", "bvh_aabb", "dof_M0"),
    ):
        np.testing.assert_allclose(
            getattr(model, field)[1:],
            getattr(expected, field)[1:],
            atol=1e-9,
            err_msg=field,
        )


def mass_matrix(model, data):
    """Return M at the present configuration, shape (nv, nv)."""
    mujoco.mj_forward(model, data)
    columns = []
    for unit in np.eye(model.nv):
        column = np.empty(model.nv)
        mujoco.mj_mulM(model, data, column, unit)
        columns.append(column)
    return np.array(columns)


@pytest.mark.parametrize("name", PAIRS)
def test_the_mass_matrix_is_that_of_the_new_sizes(name):
    """MuJoCo takes that of bodies without offset from a constant, `dof_M0`."""
    first, second = PAIRS[name]
    model, data = scene(first)
    ObjectState(model, data, "x").reshape(second)
    np.testing.assert_allclose(
        mass_matrix(model, data), mass_matrix(*scene(second)), atol=1e-12
    )


def test_shapes_change_back():
    first, second = PAIRS["hammer"]
    model, data = scene(first)
    before = model.geom_size.copy(), model.body_mass.copy(), model.site_pos.copy()
    state = ObjectState(model, data, "x")
    state.reshape(second)
    state.reshape(first)
    for kept, now in zip(
        before, (model.geom_size, model.body_mass, model.site_pos), strict=True
    ):
        np.testing.assert_allclose(now, kept, atol=1e-12)


def cylinder_extent(radius, height):
    state = ObjectState(*scene(cylinder("x", radius, height / 2)), "x")
    return state.extent()


def placed(x, y, z, extent):
    return Placed(position=(x, y, z), quat=(1.0, 0.0, 0.0, 0.0), extent=extent)


@pytest.mark.parametrize(
    ("other", "gap", "touches"),
    [
        ((0.19, 0.0, 0.0), 0.0, True),
        ((0.21, 0.0, 0.0), 0.0, False),
        ((0.21, 0.0, 0.0), 0.05, True),
        ((0.15, 0.15, 0.0), 0.0, False),
        ((0.0, 0.0, 0.2), 0.0, False),  # one stands on the other
        ((0.0, 0.0, 0.19), 0.0, True),
        ((0.0, 0.0, -0.21), 0.0, False),
    ],
)
def test_cylinders_touch_side_by_side_and_in_height(other, gap, touches):
    extent = cylinder_extent(0.1, 0.2)
    first, second = placed(0.0, 0.0, 0.0, extent), placed(*other, extent)
    assert first.touches(second, gap) is touches
    assert second.touches(first, gap) is touches


def test_samples_fill_the_region():
    """Each quarter of a region gets about a quarter of the samples."""
    ends: Interval = (-0.3, 0.3)
    sampler = UniformSampler(names=["x"], region=Region(x=ends, y=ends))
    state = ObjectState(*scene(box("x", (0.02, 0.02, 0.02))), "x")
    rng = np.random.default_rng(0)
    places = [sampler.sample(rng, {"x": state}, {})["x"].position for _ in range(400)]
    x, y, z = np.array(places).T
    np.testing.assert_allclose(z, 0.02)
    for right in (True, False):
        for upper in (True, False):
            share = np.mean(((x > 0) == right) & ((y > 0) == upper))
            assert 0.18 < share < 0.32
