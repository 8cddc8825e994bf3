"""MuJoCo and Pinocchio, number against number, on models with each kind of root."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.errors import UnknownNameError
from wbc_suite.kinematics import Conversion

LINKS = [  # joint, kind, parent, position in the parent, axis, mass, com, inertia
    ("hinge", "hinge", 0, (0.1, 0.2, 0.3), (0, 0, 1), 1.5, (0.1, 0, 0.2)),
    ("slide", "slide", 1, (0.0, 0.1, 0.4), (0, 1, 0), 0.7, (0, 0.1, 0)),
    ("far", "hinge", 1, (0.3, 0.0, 0.1), (1, 0, 0), 0.9, (0.1, 0.1, 0.1)),
]
INERTIA = np.diag([0.02, 0.03, 0.04])
GRAVITY = np.array([0.0, 0.0, -9.81])


def build_mujoco(root: str, extra: bool = False) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = GRAVITY
    if extra:  # an object before the robot shifts every index
        ball = spec.worldbody.add_body(name="object", pos=[2, 0, 0])
        ball.add_freejoint(name="object")
        inertial(ball, 0.3, (0, 0, 0))
    base = spec.worldbody.add_body(name="base")
    inertial(base, 3.0, (0.05, -0.02, 0.1))
    if root == "free":
        base.add_freejoint(name="root")
    elif root == "planar":
        for name, kind, axis in PLANAR:
            base.add_joint(name=name, type=mujoco_type(kind), axis=axis)
    bodies = [base]
    for name, kind, parent, pos, axis, mass, com in LINKS:
        body = bodies[parent].add_body(name=name, pos=pos)
        body.add_joint(name=name, type=mujoco_type(kind), axis=axis)
        inertial(body, mass, com)
        bodies.append(body)
    return spec.compile()


PLANAR = [
    ("root_x", "slide", (1, 0, 0)),
    ("root_y", "slide", (0, 1, 0)),
    ("root_yaw", "hinge", (0, 0, 1)),
]


def mujoco_type(kind: str):
    joint = mujoco.mjtJoint
    return joint.mjJNT_HINGE if kind == "hinge" else joint.mjJNT_SLIDE


def inertial(body, mass, com):
    body.mass, body.ipos = mass, com
    body.fullinertia = [0.02, 0.03, 0.04, 0, 0, 0]
    body.explicitinertial = True


def build_pinocchio(root: str) -> pin.Model:
    model = pin.Model()
    model.gravity = pin.Motion(GRAVITY, np.zeros(3))
    base = 0
    if root == "free":
        base = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    elif root == "planar":
        for name, kind, axis in PLANAR:
            joint = pinocchio_joint(kind, axis)
            base = model.addJoint(base, joint, pin.SE3.Identity(), name)
    if base:
        body = pin.Inertia(3.0, np.array([0.05, -0.02, 0.1]), INERTIA)
        model.appendBodyToJoint(base, body, pin.SE3.Identity())
    joints = [base]
    for name, kind, parent, pos, axis, mass, com in LINKS:
        placement = pin.SE3(np.eye(3), np.array(pos))
        k = model.addJoint(joints[parent], pinocchio_joint(kind, axis), placement, name)
        model.appendBodyToJoint(
            k, pin.Inertia(mass, np.array(com), INERTIA), pin.SE3.Identity()
        )
        joints.append(k)
    return model


def pinocchio_joint(kind, axis):
    axis = np.array(axis, dtype=float)
    if kind == "hinge":
        return pin.JointModelRevoluteUnaligned(axis)
    return pin.JointModelPrismaticUnaligned(axis)


@pytest.fixture(params=["fixed", "planar", "free"])
def engines(request):
    mj, pn = build_mujoco(request.param), build_pinocchio(request.param)
    rng = np.random.default_rng(7)
    data = mujoco.MjData(mj)
    mujoco.mj_integratePos(mj, data.qpos, rng.normal(size=mj.nv), 1.0)
    data.qvel[:] = rng.normal(size=mj.nv)
    data.qacc[:] = rng.normal(size=mj.nv)
    mujoco.mj_forward(mj, data)
    return mj, data, pn, pn.createData(), Conversion(mj, pn), rng


def test_q_goes_there_and_back_and_gives_the_same_poses(engines):
    _, data, pn, pd, conversion, _ = engines
    q = conversion.q_to_pinocchio(data.qpos)
    np.testing.assert_array_equal(conversion.q_to_mujoco(q), data.qpos)
    pin.forwardKinematics(pn, pd, q)
    for name, *_ in LINKS:
        body = data.body(name)
        pose = pd.oMi[pn.getJointId(name)]
        np.testing.assert_allclose(body.xpos, pose.translation, atol=1e-12)
        np.testing.assert_allclose(body.xmat.reshape(3, 3), pose.rotation, atol=1e-12)


def test_mass_matrix_agrees(engines):
    mj, data, pn, pd, conversion, _ = engines
    M = np.zeros((mj.nv, mj.nv))
    mujoco.mj_fullM(mj, data, M)
    ours = pin.crba(pn, pd, conversion.q_to_pinocchio(data.qpos))
    ours = np.triu(ours) + np.triu(ours, 1).T
    np.testing.assert_allclose(
        conversion.mass_matrix_to_mujoco(data.qpos, ours), M, atol=1e-12
    )


def test_velocity_and_jacobian_agree(engines):
    mj, data, pn, pd, conversion, _ = engines
    q = conversion.q_to_pinocchio(data.qpos)
    v = conversion.v_to_pinocchio(data.qpos, data.qvel)
    back = conversion.v_to_mujoco(data.qpos, v)
    np.testing.assert_allclose(back, data.qvel, atol=1e-14)
    pin.computeJointJacobians(pn, pd, q)
    Jp, Jr = np.zeros((3, mj.nv)), np.zeros((3, mj.nv))
    mujoco.mj_jacBody(mj, data, Jp, Jr, mj.body("far").id)
    J = pin.getJointJacobian(
        pn, pd, pn.getJointId("far"), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )
    np.testing.assert_allclose(
        conversion.jacobian_to_mujoco(data.qpos, J), np.vstack([Jp, Jr]), atol=1e-12
    )
    np.testing.assert_allclose(J @ v, np.vstack([Jp, Jr]) @ data.qvel, atol=1e-12)


def test_inverse_dynamics_and_bias_agree(engines):
    mj, data, pn, pd, conversion, rng = engines
    q = conversion.q_to_pinocchio(data.qpos)
    v = conversion.v_to_pinocchio(data.qpos, data.qvel)
    for qacc in (np.zeros(mj.nv), rng.normal(size=mj.nv)):
        data.qacc[:] = qacc
        mujoco.mj_inverse(mj, data)
        a = conversion.a_to_pinocchio(data.qpos, data.qvel, qacc)
        tau = conversion.tau_to_mujoco(data.qpos, pin.rnea(pn, pd, q, v, a))
        np.testing.assert_allclose(tau, data.qfrc_inverse, atol=1e-10)
        np.testing.assert_allclose(
            conversion.a_to_mujoco(data.qpos, data.qvel, a), qacc, atol=1e-12
        )
        back = conversion.tau_to_pinocchio(data.qpos, tau)
        np.testing.assert_allclose(
            conversion.tau_to_mujoco(data.qpos, back), tau, atol=1e-12
        )
    mujoco.mj_forward(mj, data)
    a = conversion.a_to_pinocchio(data.qpos, data.qvel, np.zeros(mj.nv))
    bias = conversion.tau_to_mujoco(data.qpos, pin.rnea(pn, pd, q, v, a))
    np.testing.assert_allclose(bias, data.qfrc_bias, atol=1e-10)


def test_a_robot_among_objects_keeps_its_own_entries():
    mj, pn = build_mujoco("free", extra=True), build_pinocchio("free")
    conversion = Conversion(mj, pn)
    qpos = np.arange(mj.nq, dtype=float)
    q = conversion.q_to_pinocchio(qpos)
    np.testing.assert_array_equal(q, [7, 8, 9, 11, 12, 13, 10, 14, 15, 16])
    out = np.full(mj.nq, -1.0)
    conversion.q_to_mujoco(q, out=out)
    np.testing.assert_array_equal(out[:7], -1.0)
    np.testing.assert_array_equal(out[7:], qpos[7:])


def test_a_missing_joint_is_named():
    mj, pn = build_mujoco("fixed"), build_pinocchio("fixed")
    with pytest.raises(UnknownNameError, match="robot0_hinge"):
        Conversion(mj, pn, prefix="robot0_")
