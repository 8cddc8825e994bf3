"""Balance: contact forces against weights, and what is drawn."""

import dataclasses

import mujoco
import numpy as np
import pytest

from wbc_suite.viewers.balance_overlay import (
    ARROW,
    CAPTURE_POINT,
    FOOTSTEP,
    LIFTED,
    RADIUS,
    STANDING,
    force_arrows,
    marks_of,
)
from wbc_suite.viewers.balance_status import BalanceStatus, FootStatus, contact_forces

BOX = """<mujoco>
  <option timestep="0.001"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1"/>
    <body name="robot" pos="0 0 0.1">
      <freejoint/>
      <geom type="box" size="0.2 0.1 0.1" mass="5"/>
      <geom type="box" size="0.05 0.05 0.05" pos="0.1 0 0.15" mass="3"/>
    </body>
    <body name="other" pos="1 0 0.1">
      <freejoint/>
      <geom type="box" size="0.1 0.1 0.1" mass="2"/>
    </body>
  </worldbody>
</mujoco>"""
WEIGHT = 8.0 * 9.81


@pytest.fixture(params=[False, True], ids=["floor first", "floor last"])
def at_rest(request):
    """A box at rest; MuJoCo orders the geoms of a contact, so both orders are tried."""
    text = BOX
    if request.param:  # a floor in a fixed body behind the robot
        text = text.replace('<geom name="floor" type="plane" size="5 5 0.1"/>', "")
        floor = '<body pos="0 0 -1"><geom type="box" size="5 5 1"/></body>'
        text = text.replace("</worldbody>", floor + "</worldbody>")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for _ in range(2000):
        mujoco.mj_step(model, data)
    return model, data


def test_contact_force_carries_the_weight_at_the_centre_of_mass(at_rest):
    model, data = at_rest
    points, forces = contact_forces(model, data, model.body("robot").id)
    assert len(points) == 1  # the other box's contacts are not the robot's
    np.testing.assert_allclose(forces[0], [0, 0, WEIGHT], atol=0.02 * WEIGHT)
    com = data.subtree_com[model.body("robot").id]
    np.testing.assert_allclose(points[0][:2], com[:2], atol=2e-3)


def test_nothing_in_contact_gives_no_force(at_rest):
    model, data = at_rest
    data.qpos[2] += 1.0
    mujoco.mj_forward(model, data)
    points, forces = contact_forces(model, data, model.body("robot").id)
    assert points.shape == forces.shape == (0, 3)


def status(*, walking):
    def foot(name, y, stands):
        return FootStatus(
            name=name,
            position=np.array([0.1, y, 0.0]),
            yaw=np.pi / 2,
            sole=np.array([-0.1, 0.2, -0.03, 0.03]),
            stands=stands,
        )

    return BalanceStatus(
        feet=(foot("left", 0.2, True), foot("right", 0.0, not walking)),
        capture_point=np.array([0.3, 0.1, 0.0]),
        margin=0.0,
        footstep=np.array([0.5, 0.0, 0.0]) if walking else None,
        forces=np.array([[0, 0, 500.0], [0, 0, 1.0]]),
        points=np.array([[0.1, 0.25, 0], [0.1, 0.05, 0]]),
        weight=500.0,
    )


def box(mark):
    """Lowest and highest x and y of the lines, in the world."""
    points = mark.segments.reshape(-1, 3) @ mark.pose.rotation.T + mark.pose.translation
    return [*points[:, :2].min(axis=0), *points[:, :2].max(axis=0)]


def test_feet_footstep_and_capture_point_are_outlined_where_they_are():
    marks = marks_of(status(walking=True))
    for name, colour, expected in (
        ("standing/left", STANDING, [0.07, 0.1, 0.13, 0.4]),  # it points along y
        ("lifted/right", LIFTED, [0.07, -0.1, 0.13, 0.2]),
        ("footstep/right", FOOTSTEP, [0.47, -0.1, 0.53, 0.2]),
        ("capture_point", CAPTURE_POINT, [0.21, 0.01, 0.39, 0.19]),
    ):
        assert marks[name].colour == colour
        np.testing.assert_allclose(box(marks[name]), expected, atol=1e-6)
    assert len(marks) == 4
    standing = marks_of(status(walking=False))
    assert {*standing} == {"standing/left", "standing/right", "capture_point"}


def test_a_foot_without_a_sole_is_a_circle():
    state = status(walking=False)
    ball = dataclasses.replace(state.feet[0], sole=np.zeros(4))
    marks = marks_of(dataclasses.replace(state, feet=(ball,)))
    low, high = np.reshape(box(marks["standing/left"]), (2, 2))
    np.testing.assert_allclose(high - low, 2.0 * RADIUS, atol=1e-6)
    np.testing.assert_allclose((high + low) / 2.0, [0.1, 0.2], atol=1e-6)


def test_arrow_of_the_whole_weight_has_its_length_and_weak_forces_none():
    points, vectors = force_arrows(status(walking=True))
    np.testing.assert_allclose(points, [[0.1, 0.25, 0.0]])
    np.testing.assert_allclose(vectors, [[0.0, 0.0, ARROW]])
    assert len(force_arrows(None)[0]) == 0
