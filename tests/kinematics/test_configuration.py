"""Configuration: what it reads off Pinocchio, against finite differences."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.kinematics import Configuration

STEP = 1e-6
HAND = "rarm_wrist2_joint"


@pytest.fixture
def humanoid() -> Configuration:
    model = pin.buildSampleModelHumanoid()
    q = pin.neutral(model)
    q[7:] = np.random.default_rng(1).uniform(-0.8, 0.8, model.nq - 7)
    return Configuration(model, q)


def test_joint_poses_follow_updates_in_one_buffer(humanoid):
    view = humanoid.joint_poses
    humanoid.update(humanoid.integrate(np.full(humanoid.nv, 0.1)))
    assert humanoid.joint_poses is view
    for k, pose in enumerate(humanoid.data.oMi):
        rotation = view[k, :9].reshape(3, 3).T
        np.testing.assert_allclose(rotation, pose.rotation, atol=1e-12)
        np.testing.assert_allclose(view[k, 9:], pose.translation, atol=1e-12)


def test_refresh_discards_what_was_computed_from_another_q(humanoid):
    before = humanoid.com.copy(), humanoid.frame_pose(HAND)
    humanoid.q[7:] += 0.2
    humanoid.refresh()
    assert np.abs(humanoid.com - before[0]).max() > 1e-3
    assert not humanoid.frame_pose(HAND).isApprox(before[1], 1e-3)


@pytest.mark.parametrize("axes", ["local", "aligned", "world"])
def test_frame_jacobian_agrees_with_finite_differences(humanoid, axes):
    q = humanoid.q.copy()
    J = humanoid.frame_jacobian(HAND, axes).copy()
    pose = humanoid.frame_pose(HAND)
    numeric = np.empty_like(J)
    for i in range(humanoid.nv):
        dq = np.zeros(humanoid.nv)
        dq[i] = STEP
        humanoid.update(pin.integrate(humanoid.model, q, dq))
        ahead = humanoid.frame_pose(HAND)
        humanoid.update(pin.integrate(humanoid.model, q, -dq))
        twist = pin.log6(humanoid.frame_pose(HAND).actInv(ahead)) / (2 * STEP)
        if axes == "world":
            twist = pose.act(twist)
        elif axes == "aligned":
            twist = pin.SE3(pose.rotation, np.zeros(3)).act(twist)
        numeric[:, i] = twist.vector
    np.testing.assert_allclose(J, numeric, atol=1e-8)


def test_com_and_its_jacobian(humanoid):
    q = humanoid.q.copy()
    J = humanoid.com_jacobian.copy()
    numeric = np.empty_like(J)
    for i in range(humanoid.nv):
        dq = np.zeros(humanoid.nv)
        dq[i] = STEP
        humanoid.update(pin.integrate(humanoid.model, q, dq))
        ahead = humanoid.com.copy()
        humanoid.update(pin.integrate(humanoid.model, q, -dq))
        numeric[:, i] = (ahead - humanoid.com) / (2 * STEP)
    np.testing.assert_allclose(J, numeric, atol=1e-8)


def test_integrate_undoes_difference(humanoid):
    rng = np.random.default_rng(2)
    dq = rng.normal(size=humanoid.nv) * 0.3
    q = humanoid.integrate(dq)
    np.testing.assert_allclose(humanoid.difference(q), dq, atol=1e-12)


def test_support_is_where_the_jacobian_is_not_zero(humanoid):
    J = humanoid.frame_jacobian(HAND, "world")
    columns = np.flatnonzero(np.abs(J).max(axis=0) > 0)
    np.testing.assert_array_equal(humanoid.support(HAND), columns)


def test_root_indices_of_a_free_root(humanoid):
    np.testing.assert_array_equal(humanoid.root_linear, [0, 1, 2])
    np.testing.assert_array_equal(humanoid.root_angular, [3, 4, 5])
    assert len(humanoid.velocity_names()) == humanoid.nv
    assert humanoid.velocity_names()[6] == "rleg_shoulder1_joint"


def test_wrong_names_and_shapes_are_refused(humanoid):
    with pytest.raises(UnknownNameError, match="Did you mean 'rarm_wrist2_joint'"):
        humanoid.frame_id("rarm_wrist_joint")
    with pytest.raises(UnknownNameError, match="No joint named"):
        humanoid.joint_id("nose")
    with pytest.raises(ConfigError, match=r"has shape \(3,\), but must have \(35,\)"):
        humanoid.update(np.zeros(3))


def test_a_robot_of_one_joint_has_jacobians_of_one_column():
    """Pinocchio hands a single column over as a vector."""
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "hinge")
    arm = pin.SE3(np.eye(3), np.array([1.0, 0.0, 0.0]))
    model.appendBodyToJoint(joint, pin.Inertia(1.0, np.zeros(3), np.eye(3)), arm)
    model.addFrame(pin.Frame("tip", joint, 0, arm, pin.FrameType.OP_FRAME))
    one = Configuration(model)
    expected = np.array([[0.0, 1.0, 0.0, 0.0, 0.0, 1.0]]).T
    np.testing.assert_allclose(one.frame_jacobian("tip"), expected)
    np.testing.assert_allclose(one.com_jacobian, expected[:3])
    one.update(np.array([np.pi / 2]))
    assert one.joint_jacobians.shape == (1, 6)
    np.testing.assert_allclose(one.frame_jacobian("tip", "aligned")[0], [-1.0])
