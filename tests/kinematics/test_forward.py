"""The compiled forward kinematics, against Pinocchio."""

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import JointKind, robot_arrays
from wbc_suite.kinematics.tangent_space import integrate_joints

ROBOTS = ("GR1", "Tiago", "Panda", "SpotWithArm", "Baxter", "UR5e", "Jaco")


def chain(*joints: pin.JointModel) -> pin.Model:
    """Return a chain of joints at odd places, one body each."""
    model, rng = pin.Model(), np.random.default_rng(3)
    parent = 0
    for k, joint in enumerate(joints):
        place = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3))
        parent = model.addJoint(parent, joint, place, f"joint_{k}")
        model.appendBodyToJoint(parent, pin.Inertia.Random(), pin.SE3.Identity())
    return model


def random_q(model: pin.Model, rng: np.random.Generator) -> np.ndarray:
    return pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv) * 2.0)


def check(model: pin.Model) -> None:
    rng, robot, data = (
        np.random.default_rng(0),
        Configuration(model),
        model.createData(),
    )
    for _ in range(20):
        q = random_q(model, rng)
        robot.update(q)
        J = pin.computeJointJacobians(model, data, q)
        np.testing.assert_allclose(robot.joint_jacobians.T, J, atol=1e-12)
        for T, expected in zip(robot.joint_poses, data.oMi, strict=True):
            rotation = T[:9].reshape(3, 3).T
            np.testing.assert_allclose(rotation, expected.rotation, atol=1e-12)
            np.testing.assert_allclose(T[9:], expected.translation, atol=1e-12)
        J_com = pin.jacobianCenterOfMass(model, data, q)
        np.testing.assert_allclose(robot.com_jacobian, J_com, atol=1e-12)
        np.testing.assert_allclose(robot.com, data.com[0], atol=1e-12)
        frame = model.nframes - 1
        pose = pin.updateFramePlacement(model, data, frame)
        assert robot.frame_pose(frame).isApprox(pose, 1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_kernels_agree_with_pinocchio_on_robots(name):
    check(wbc_suite.load_robot(name).to_pinocchio())


@pytest.mark.parametrize("root", ["planar", "free"])
def test_kernels_agree_with_pinocchio_under_moving_roots(root):
    model = wbc_suite.load_robot("GR1", root=root).to_pinocchio()
    assert (robot_arrays(model).joints["kind"][1:] != JointKind.OTHER).all()
    check(model)


def test_kernels_agree_with_pinocchio_on_every_joint_they_know():
    axis = np.array([0.6, 0.0, 0.8])
    model = chain(
        pin.JointModelFreeFlyer(),
        pin.JointModelRX(),
        pin.JointModelRY(),
        pin.JointModelPX(),
        pin.JointModelPY(),
        pin.JointModelRevoluteUnaligned(axis),
        pin.JointModelPZ(),
        pin.JointModelPrismaticUnaligned(axis),
        pin.JointModelFreeFlyer(),
        pin.JointModelRZ(),
    )
    assert (robot_arrays(model).joints["kind"][1:] != JointKind.OTHER).all()
    check(model)


def test_pinocchio_places_joints_that_the_kernels_do_not_know():
    model = chain(pin.JointModelRX(), pin.JointModelSpherical(), pin.JointModelRUBY())
    kinds = robot_arrays(model).joints["kind"]
    assert (kinds == JointKind.OTHER).sum() == 3  # and the universe
    check(model)


def test_what_follows_from_q_is_computed_anew_after_each_update():
    model = wbc_suite.load_robot("Panda").to_pinocchio()
    robot = Configuration(model)
    before = robot.joint_poses.copy(), robot.com.copy(), robot.com_jacobian.copy()
    robot.update(robot.q + 0.3)
    assert np.abs(robot.com - before[1]).max() > 1e-2
    assert np.abs(robot.com_jacobian - before[2]).max() > 1e-2
    assert np.abs(robot.joint_poses - before[0]).max() > 1e-2


@pytest.mark.parametrize("size", [1e-9, 1e-5, 1e-3, 0.5, 3.0])
def test_integration_agrees_with_pinocchio(size):
    model = chain(
        pin.JointModelFreeFlyer(), pin.JointModelRX(), pin.JointModelFreeFlyer()
    )
    robot, rng = Configuration(model), np.random.default_rng(4)
    for _ in range(20):
        robot.update(random_q(model, rng))
        dq = rng.normal(size=model.nv) * size
        expected = pin.integrate(model, robot.q, dq)
        before, _ = robot.joint_poses.copy(), robot.data
        integrate_joints(robot.robot, dq)
        np.testing.assert_allclose(robot.q, expected, atol=1e-12)
        assert np.abs(robot.joint_poses - before).max() > 0.1 * size
        data = model.createData()
        pin.forwardKinematics(model, data, expected)
        assert robot.data.oMi[3].isApprox(data.oMi[3], 1e-9)  # not of the q before
