"""Objects have the sizes, masses and holes that their docstrings promise."""

import inspect

import mujoco
import numpy as np
import pytest

from wbc_suite.scene import objects
from wbc_suite.scene.furniture import BinConfig, ghost, peg, standing_bin
from wbc_suite.scene.objects import ObjectState, Part

LYING = (0.5, 0.5, 0.5, 0.5)


def compiled(*items):
    """Return the compiled scene of some objects, and its state."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    for item in items:
        item.add_to(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def distance(model, data, first, second):
    """Return the least distance of two bodies' solid geoms, m, negative inside."""
    geoms = [ObjectState(model, data, name).geoms for name in (first, second)]
    return min(
        mujoco.mj_geomDistance(model, data, a, b, 1.0, None)
        for a in geoms[0]
        for b in geoms[1]
    )


def put(model, data, name, position, quat=(1.0, 0.0, 0.0, 0.0)):
    ObjectState(model, data, name).move(position, quat)
    mujoco.mj_forward(model, data)


HEIGHTS = {"milk": 0.130, "cereal": 0.120, "bread": 0.044, "can": 0.085}
MASSES = {
    **{"bottle": 0.15, "bread": 0.03, "can": 0.05, "cereal": 0.068, "lemon": 0.06},
    **{"milk": 0.05, "hammer": 0.18, "square_nut": 0.04, "round_nut": 0.04},
    **{"wrench": 0.09, "hanging_frame": 0.05},
}


@pytest.mark.parametrize(("name", "height"), HEIGHTS.items())
def test_groceries_are_as_high_as_they_say(name, height):
    extent = ObjectState(*compiled(getattr(objects, name)("x")), "x").extent()
    assert extent.top + extent.bottom == pytest.approx(height, abs=1e-4)
    assert extent.top == pytest.approx(extent.bottom, abs=1e-4)


@pytest.mark.parametrize(("name", "mass"), MASSES.items())
def test_objects_weigh_what_a_gripper_can_lift(name, mass):
    model, _ = compiled(getattr(objects, name)("x"))
    assert model.body("x").mass[0] == pytest.approx(mass, rel=1e-9)


@pytest.mark.parametrize("name", [*MASSES, "pot", "plate_with_hole", "stand"])
def test_inertias_are_those_of_a_body(name):
    """Principal inertias keep the triangle inequality."""
    model, _ = compiled(getattr(objects, name)("x"))
    a, b, c = sorted(model.body("x").inertia)
    assert a > 0.0
    assert a + b >= c * (1.0 - 1e-9)


@pytest.mark.parametrize("name", [*MASSES, "pot", "plate_with_hole", "stand"])
def test_docstrings_name_every_site(name):
    maker = getattr(objects, name)
    for site in maker("x").sites:
        assert f"`{site}`" in (inspect.getdoc(maker) or "")


@pytest.mark.parametrize(
    ("nut", "part"),
    [
        ("square_nut", Part(kind="box", size=(0.016, 0.016, 0.05))),
        ("round_nut", Part(kind="cylinder", size=(0.02, 0.05))),
    ],
)
def test_a_nut_goes_over_its_peg_and_not_beside(nut, part):
    nut = getattr(objects, nut)("nut")
    model, data = compiled(nut, peg("peg", part, (0.0, 0.0, 0.0)))
    put(model, data, "nut", (0.0, 0.0, 0.05))
    assert distance(model, data, "nut", "peg") > 0.002
    for shift in ((0.012, 0.0), (0.0, 0.012), (-0.012, 0.0)):
        put(model, data, "nut", (*shift, 0.05))
        assert distance(model, data, "nut", "peg") < 0.0


def test_a_peg_stands_on_its_foot():
    part = Part(kind="cylinder", size=(0.02, 0.05))
    model, data = compiled(peg("peg", part, (0.1, 0.2, 0.8)))
    extent = ObjectState(model, data, "peg").extent()
    bottom = data.body("peg").xpos[2] - extent.bottom
    assert bottom == pytest.approx(0.8)
    np.testing.assert_allclose(data.body("peg").xpos[:2], (0.1, 0.2))


def test_the_rod_of_the_frame_fits_into_the_socket_of_the_stand():
    model, data = compiled(
        objects.stand("stand").fixed((0.0, 0.0, 0.0)), objects.hanging_frame("frame")
    )
    tip, floor = data.site("frame_tip").xpos, data.site("stand_floor").xpos
    down = (floor - tip + (0.0, 0.0, 1e-4)).tolist()
    put(model, data, "frame", down)
    assert distance(model, data, "frame", "stand") > 0.0
    assert data.site("frame_tip").xpos[2] < data.site("stand_socket").xpos[2] - 0.09
    put(model, data, "frame", (down[0] + 0.008, down[1], down[2]))
    assert distance(model, data, "frame", "stand") < 0.0


@pytest.mark.parametrize("hole", ["hole1", "hole2"])
def test_the_hook_of_the_frame_fits_through_both_holes_of_the_wrench(hole):
    model, data = compiled(
        objects.hanging_frame("frame").fixed((0.0, 0.0, 0.0)), objects.wrench("wrench")
    )
    turned = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)  # the axis of its holes along x
    put(model, data, "wrench", (0.0, 0.0, 1.0), turned)
    hook = data.site("frame_hook").xpos
    way = hook - data.site(f"wrench_{hole}").xpos
    put(model, data, "wrench", np.add(way, (0.0, 0.0, 1.0)).tolist(), turned)
    np.testing.assert_allclose(data.site(f"wrench_{hole}").xpos, hook, atol=1e-12)
    assert distance(model, data, "wrench", "frame") > 0.0


def test_a_ball_falls_through_the_hole_of_a_plate_and_not_through_its_rim():
    plate = objects.plate_with_hole("plate").fixed((0.0, 0.0, 0.0))
    model, data = compiled(plate, objects.ball("ball", 0.04))
    put(model, data, "ball", (0.0, 0.0, 0.0))
    assert distance(model, data, "ball", "plate") == pytest.approx(0.005, abs=1e-6)
    put(model, data, "ball", (0.08, 0.0, 0.0))
    assert distance(model, data, "ball", "plate") < 0.0


def test_tubes_and_bins_are_hollow():
    for hollow, inside in (
        (objects.hollow_cylinder("x", 0.05, 0.06, 0.1), 0.049),
        (objects.open_bin("x", (0.12, 0.12, 0.2), wall=0.01), 0.049),
        (objects.pot("x", half_size=(0.06, 0.06, 0.06), wall=0.006), 0.05),
    ):
        model, data = compiled(hollow.fixed((0, 0, 0)), objects.ball("ball", inside))
        put(model, data, "ball", (0.0, 0.0, 0.0 if "cyl" in hollow.name else 0.06))
        assert distance(model, data, "ball", "x") > 0.0
        wall = 0.055 if inside == 0.049 else 0.057
        put(model, data, "ball", (wall, 0.0, 0.06))
        assert distance(model, data, "ball", "x") < 0.0


def test_a_lid_covers_its_bin():
    size = (0.2, 0.16, 0.1)
    model, data = compiled(
        objects.open_bin("bin", size).fixed((0.0, 0.0, 0.0)),
        objects.lid("lid", (0.2, 0.16, 0.01)),
    )
    put(model, data, "lid", (0.0, 0.0, 0.1051))
    assert 0.0 < distance(model, data, "lid", "bin") < 0.001
    assert data.site("lid_handle").xpos[2] > 0.14


def test_a_hammer_lies_with_its_handle_along_x_and_its_head_along_y():
    model, data = compiled(objects.hammer("hammer"))
    put(model, data, "hammer", (0.0, 0.0, 0.0), LYING)
    head = data.site("hammer_head").xpos - data.site("hammer_handle").xpos
    np.testing.assert_allclose(head, (0.11, 0.0, 0.0), atol=1e-12)
    R = data.body("hammer").xmat.reshape(3, 3)
    np.testing.assert_allclose(R[:, 0], (0.0, 1.0, 0.0), atol=1e-12)


def test_a_pot_is_grasped_by_handles_on_both_sides():
    _, data = compiled(objects.pot("pot"))
    first, second = data.site("pot_handle0").xpos, data.site("pot_handle1").xpos
    np.testing.assert_allclose(first, second * (1, -1, 1), atol=1e-12)
    assert first[1] == pytest.approx(0.07 + 0.09 - 0.01)
    assert data.site("pot_bottom").xpos[2] == pytest.approx(-0.035)


def test_quadrants_divide_a_standing_bin():
    config = BinConfig(size=(0.3, 0.4, 0.1), center=(0.0, 0.0, 0.8))
    plain, divided = (
        compiled(standing_bin("bin", config, quadrants=q), objects.ball("ball", 0.04))
        for q in (False, True)
    )
    for model, data in (plain, divided):
        put(model, data, "ball", (0.0, 0.0, 0.85))
    assert distance(*plain, "ball", "bin") > 0.0
    assert distance(*divided, "ball", "bin") < 0.0
    for x, y in ((0.075, 0.1), (-0.075, 0.1), (0.075, -0.1), (-0.075, -0.1)):
        put(*divided, "ball", (x, y, 0.85))
        assert distance(*divided, "ball", "bin") > 0.0


def test_legs_of_a_standing_bin_reach_the_floor():
    config = BinConfig(size=(0.3, 0.4, 0.1), center=(0.5, 0.0, 0.8))
    model, data = compiled(standing_bin("bin", config))
    extent = ObjectState(model, data, "bin").extent()
    assert extent.bottom == pytest.approx(0.8, abs=1e-9)


def test_a_ghost_looks_like_its_original_and_touches_nothing():
    milk = objects.milk("milk")
    likeness = ghost(milk, "goal", (0.0, 0.0, 0.5))
    model, _ = compiled(likeness)
    assert len(likeness.parts) == sum(part.drawn for part in milk.parts)
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    np.testing.assert_allclose(model.geom_rgba[:, 3], 0.3, atol=1e-6)
    assert model.nsite == 0


def test_a_door_opens_towards_y_and_a_latch_needs_the_lever():
    model, data = compiled(objects.door("door"))
    grip = data.site("door_handle_grip").xpos.copy()
    data.joint("door_panel_joint").qpos[0] = 0.5
    mujoco.mj_forward(model, data)
    assert data.site("door_handle_grip").xpos[1] > grip[1] + 0.05
    low, high = model.joint("door_handle_joint").range
    assert (low, high) == (0.0, 1.6)
    plain, _ = compiled(objects.door("door", latch=False))
    assert plain.joint("door_handle_joint").range[1] == pytest.approx(0.001)
