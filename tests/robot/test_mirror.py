# ruff: noqa: E501 - TOML inline tables stay on one line
"""`[mirror]` against its definition: the other side moves as in a looking glass."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.robot import load_robot

REFLECTION = np.diag([1.0, -1.0, 1.0])

HALF = """
format = 1
[component]
name = "half"
kind = "body"
[mirror]
[[link]]
name = "trunk"
mass = 2.0
inertia = [0.1, 0.1, 0.1, 0, 0, 0]
[[link]]
name = "left_upper"
parent = "trunk"
pos = [0.1, 0.2, 0.3]
rpy = [0.3, -0.2, 0.5]
mass = 1.0
com = [0.01, 0.02, 0.03]
inertia = [0.02, 0.03, 0.04, 0.001, 0.002, 0.003]
joint = { name = "left_shoulder", axis = [0, 0, 1], range = [-0.5, 1.5] }
visual = [
  { shape = "box", pos = [0.01, 0.02, 0.05], rpy = [0.1, 0.2, 0.3], size = [0.03, 0.1, 0.3] },
]
[[link]]
name = "left_fore"
parent = "left_upper"
pos = [0.0, 0.05, 0.2]
rpy = [-0.4, 0.1, 0.2]
mass = 0.5
com = [0.0, 0.01, 0.02]
inertia = [0.01, 0.01, 0.01, 0.0002, 0, 0]
joint = { name = "left_elbow", axis = [0.6, 0.8, 0], range = [-1, 2] }
[[link]]
name = "left_finger"
parent = "left_fore"
pos = [0.1, 0.0, 0.0]
mass = 0.1
inertia = [0.001, 0.001, 0.001, 0, 0, 0]
joint = { name = "left_slide", type = "slide", axis = [0, 1, 0], range = [0, 0.1] }
[[link]]
name = "left_thumb"
parent = "left_fore"
pos = [0.1, 0.0, 0.1]
mass = 0.1
inertia = [0.001, 0.001, 0.001, 0, 0, 0]
joint = { name = "left_thumb_slide", type = "slide", axis = [0, 0, 1], range = [0, 0.2], mimic = { joint = "left_slide", ratio = 2.0 } }
[[frame]]
name = "left_hand"
link = "left_fore"
pos = [0.02, 0.03, 0.1]
rpy = [0.2, 0.4, -0.1]
[groups]
left_arm = ["left_shoulder", "left_elbow", "left_slide"]
[keyframe.ready]
left_shoulder = 1.0
left_elbow = 0.7
left_slide = 0.05
"""

BY_HAND = """
[[link]]
name = "right_upper"
parent = "trunk"
quat = [0.5, -0.5, 0.5, 0.5]
"""


@pytest.fixture(params=["reflected", "frame given by hand"])
def robot(request, tmp_path):
    path = tmp_path / "half.toml"
    text = HALF
    if request.param != "reflected":
        text = text.replace("[[frame]]", BY_HAND + "[[frame]]", 1)
    path.write_text(text)
    return load_robot(path)


def test_both_sides_have_the_same_joints_and_groups(robot):
    assert robot.groups["right_arm"] == ("right_shoulder", "right_elbow", "right_slide")
    assert robot.joint("right_thumb_slide").mimic.joint == "right_slide"


def test_ready_posture_and_masses_are_symmetric(robot):
    model, data = robot.to_pinocchio(), robot.to_pinocchio().createData()
    q = model.referenceConfigurations["ready"]
    pin.framesForwardKinematics(model, data, q)
    left = data.oMf[model.getFrameId("left_hand", pin.FrameType.OP_FRAME)]
    right = data.oMf[model.getFrameId("right_hand", pin.FrameType.OP_FRAME)]
    np.testing.assert_allclose(right.translation, REFLECTION @ left.translation)
    np.testing.assert_allclose(
        right.rotation, REFLECTION @ left.rotation @ REFLECTION, atol=1e-12
    )
    assert abs(pin.centerOfMass(model, data, q)[1]) < 1e-12
    inertia = pin.ccrba(model, data, q, np.zeros(model.nv))
    assert inertia.shape == (6, model.nv)
    whole = data.Ig.inertia
    assert abs(whole[0, 1]) < 1e-12
    assert abs(whole[1, 2]) < 1e-12


def test_shapes_are_reflected_with_their_link(robot):
    mujoco = pytest.importorskip("mujoco")
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    left, right = data.geom("left_upper_visual0"), data.geom("right_upper_visual0")
    np.testing.assert_allclose(right.xpos, REFLECTION @ left.xpos, atol=1e-12)
    corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    corners = corners * model.geom("left_upper_visual0").size
    there = left.xpos + corners @ left.xmat.reshape(3, 3).T
    here = right.xpos + corners @ right.xmat.reshape(3, 3).T
    for corner in there @ REFLECTION:
        assert np.abs(here - corner).max(axis=1).min() < 1e-12


def test_a_mirror_without_a_source_says_so(tmp_path):
    path = tmp_path / "half.toml"
    path.write_text(HALF.replace("[mirror]", '[mirror]\nsource = "west"'))
    with pytest.raises(ValueError, match="no link has this word"):
        load_robot(path)
