"""Poses of description items: products, fields and joint motions."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.robot.poses import (
    compose,
    joint_motion,
    pose_fields,
    rotation_matrix,
    se3_of,
)
from wbc_suite.robot.shape_geometry import along_z
from wbc_suite.robot.shapes import Capsule, Posed

RNG = np.random.default_rng(5)


def random_posed():
    quat = RNG.normal(size=4)
    return Posed(pos=tuple(RNG.normal(size=3)), quat=tuple(quat / np.linalg.norm(quat)))


def test_fields_give_the_pose_back():
    for _ in range(20):
        posed = random_posed()
        again = se3_of(Posed(**pose_fields(se3_of(posed))))
        np.testing.assert_allclose(
            again.homogeneous, se3_of(posed).homogeneous, atol=1e-15
        )


def test_the_matrix_is_the_textbook_one():
    w, x, y, z = (q := random_posed()).quat
    expected = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    np.testing.assert_allclose(rotation_matrix(q), expected, atol=1e-14)


def test_a_product_of_poses_is_that_of_matrices():
    items = [random_posed() for _ in range(3)]
    a, b, c = (se3_of(item).homogeneous for item in items)
    product = se3_of(Posed(**compose(*items))).homogeneous
    np.testing.assert_allclose(product, a @ b @ c, atol=1e-14)


def test_identities_leave_every_digit():
    odd = Posed(pos=(0.1 + 0.2, 1 / 3, -1e-17))
    assert compose(Posed(), odd, Posed()) == {"pos": odd.pos, "quat": odd.quat}
    assert compose() == {"pos": (0, 0, 0), "quat": (1, 0, 0, 0)}


@pytest.mark.parametrize("value", [-2.0, 0.0, 0.7])
def test_joints_move_as_pinocchio_says(value):
    axis = np.array([0.6, 0.0, 0.8])
    for slide, kind in (
        (False, pin.JointModelRevoluteUnaligned(axis)),
        (True, pin.JointModelPrismaticUnaligned(axis)),
    ):
        model = pin.Model()
        limit = np.array([10.0])
        model.addJoint(0, kind, pin.SE3.Identity(), "j", limit, limit, -limit, limit)
        data = model.createData()
        pin.forwardKinematics(model, data, np.array([value]))
        motion = joint_motion(axis, value, slide=slide)
        np.testing.assert_allclose(
            motion.homogeneous, data.oMi[1].homogeneous, atol=1e-15
        )


@pytest.mark.parametrize("end", [(0, 0, 2), (0, 0, -2), (1, 0, 0), (0.3, -0.2, 0.1)])
def test_the_z_axis_of_a_segment_points_to_its_end(end):
    base = random_posed()
    shape = Capsule(
        shape="capsule",
        start=(0.1, 0, 0),
        end=end,
        radius=0.1,
        pos=base.pos,
        quat=base.quat,
    )
    posed, half = along_z(shape)
    pose = se3_of(posed)
    ends = [
        se3_of(base).act(np.array(p, dtype=float)) for p in (shape.start, shape.end)
    ]
    tips = [pose.act(np.array([0.0, 0.0, z])) for z in (-half, half)]
    np.testing.assert_allclose(tips, ends, atol=1e-14)
