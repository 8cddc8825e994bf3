"""The two exports of every robot against each other, at random states."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.robot.mjcf_export import FINGER_MARGIN, STOP_MARGIN

ROBOTS = Catalogue().names("robots")
ROOTS = ("fixed", "planar", "free")
STATES = 100
TOLERANCE = 1e-9  # two independent loaders of one robot agree to 1e-13


class Twin:
    """One robot in both engines, and the maps between their coordinates."""

    def __init__(self, robot):
        self.robot = robot
        self.m = robot.to_mjspec().compile()
        self.d = mujoco.MjData(self.m)
        self.model = robot.to_pinocchio()
        self.data = self.model.createData()
        self.free = robot.root.kind == "free"

    def random_state(self, rng):
        q = pin.neutral(self.model)
        for joint in self.robot.joints:
            low, high = joint.range or (-np.pi, np.pi)
            index = self.model.joints[self.model.getJointId(joint.name)].idx_q
            q[index] = rng.uniform(low, high)
        if self.robot.root.kind == "planar":
            q[:3] = rng.normal(size=3)
        if self.free:
            q[:3] = rng.normal(size=3)
            quat = rng.normal(size=4)
            q[3:7] = quat / np.linalg.norm(quat)
        v = rng.normal(size=self.model.nv)
        return q, v

    def set_mujoco(self, q, v):
        """q = x y z | x y z w ... in Pinocchio, x y z | w x y z ... in MuJoCo."""
        self.d.qpos[:] = q
        self.d.qvel[:] = v
        if self.free:
            self.d.qpos[3:7] = q[[6, 3, 4, 5]]
            self.d.qvel[:3] = self.rotation(q) @ v[:3]
        mujoco.mj_forward(self.m, self.d)

    @staticmethod
    def rotation(q):
        return pin.Quaternion(*q[[6, 3, 4, 5]]).matrix()

    def basis(self, q):
        """v_pin = B v_mj."""
        B = np.eye(self.model.nv)
        if self.free:
            B[:3, :3] = self.rotation(q).T
        return B

    def bias(self, q, v):
        """Bias forces in MuJoCo's coordinates."""
        a = np.zeros(self.model.nv)
        if self.free:  # zero acceleration in MuJoCo's coordinates
            a[:3] = -np.cross(v[3:6], v[:3])
        return self.basis(q).T @ pin.rnea(self.model, self.data, q, v, a)


def dense_inertia(twin):
    full = np.zeros((twin.m.nv, twin.m.nv))
    mujoco.mj_fullM(twin.m, twin.d, full)
    return full


@pytest.fixture(scope="module", params=[(r, k) for r in ROBOTS for k in ROOTS], ids=str)
def twin(request):
    name, kind = request.param
    return Twin(wbc_suite.load_robot(name, root=kind))


def test_same_joints_in_the_same_order(twin):
    mine = [twin.m.joint(i).name for i in range(twin.m.njnt)]
    assert mine == list(twin.model.names)[1:]
    assert mine == [*twin.robot.root_joint_names, *twin.robot.joint_names]
    assert twin.m.nv == twin.model.nv
    for name in mine:
        joint = twin.model.joints[twin.model.getJointId(name)]
        assert twin.m.joint(name).dofadr[0] == joint.idx_v


def test_poses_jacobians_inertia_and_bias_agree(twin):
    rng = np.random.default_rng(7)
    links = [twin.m.body(link.name).id for link in twin.robot.links]
    frames = [
        twin.model.getFrameId(x.name, pin.FrameType.BODY) for x in twin.robot.links
    ]
    for _ in range(STATES):
        q, v = twin.random_state(rng)
        twin.set_mujoco(q, v)
        pin.computeAllTerms(twin.model, twin.data, q, v)
        pin.updateFramePlacements(twin.model, twin.data)
        poses = np.array([twin.data.oMf[f].homogeneous for f in frames])
        mine = np.zeros_like(poses)
        mine[:, :3, :3] = twin.d.xmat[links].reshape(-1, 3, 3)
        mine[:, :3, 3] = twin.d.xpos[links]
        mine[:, 3, 3] = 1.0
        assert np.abs(mine - poses).max() < TOLERANCE
        assert jacobian_error(twin, twin.basis(q)) < TOLERANCE
        B, M = twin.basis(q), pin.crba(twin.model, twin.data, q)
        M = np.triu(M) + np.triu(M, 1).T
        assert np.abs(dense_inertia(twin) - B.T @ M @ B).max() < TOLERANCE
        error = np.abs(twin.d.qfrc_bias - twin.bias(q, v)).max()
        assert error < TOLERANCE * max(1.0, np.abs(twin.d.qfrc_bias).max())


def jacobian_error(twin, B):
    """Compare the Jacobians of all described frames."""
    worst, J = 0.0, np.zeros((6, twin.m.nv))
    for frame in twin.robot.frames:
        index = twin.model.getFrameId(frame.name, pin.FrameType.OP_FRAME)
        mujoco.mj_jacSite(twin.m, twin.d, J[:3], J[3:], twin.m.site(frame.name).id)
        other = pin.getFrameJacobian(
            twin.model, twin.data, index, pin.LOCAL_WORLD_ALIGNED
        )
        worst = max(worst, float(np.abs(J - other @ B).max()))
    return worst


def test_stops_are_hard():
    """A joint that swings into its stop passes it by less than a milliradian."""
    robot = wbc_suite.load_robot("Panda", gripper="none", base="none")
    spec = robot.to_mjspec()
    spec.option.gravity = (0.0, 0.0, 0.0)
    spec.option.timestep = 0.002
    model = spec.compile()
    for joint, speed in (("panda_joint4", 0.25), ("panda_joint6", 2.0)):
        data = mujoco.MjData(model)
        data.qpos[:] = model.key("ready").qpos
        high = model.joint(joint).range[1]
        data.joint(joint).qpos[0] = high - 0.02
        data.joint(joint).qvel[0] = speed
        passed = -np.inf
        for _ in range(100):
            mujoco.mj_step(model, data)
            passed = max(passed, data.joint(joint).qpos[0] - high)
        assert -STOP_MARGIN < passed < 1e-3
        assert data.joint(joint).qvel[0] < 0.0  # it was thrown back


@pytest.mark.parametrize(
    ("robot", "gripper", "joint", "margin"),
    [
        ("GR1", None, "R_thumb_proximal_pitch_joint", FINGER_MARGIN),
        ("GR1", None, "R_thumb_distal_joint", FINGER_MARGIN),
        ("GR1", None, "left_wrist_roll_joint", STOP_MARGIN),
        ("Panda", None, "panda_joint1", 2e-3 * 2.175),  # rad/s
        ("Panda", "Robotiq140Gripper", "finger_joint", 0.0),
        ("Panda", "Robotiq140Gripper", "right_outer_knuckle_joint", 0.0),
    ],
)
def test_fingers_rest_in_their_limits_and_jaws_before_them(
    robot, gripper, joint, margin
):
    """Jaws meet at the end of their travel; a blow throws fingers of hands past it."""
    chosen = {"gripper": gripper} if gripper else {}
    model = wbc_suite.load_robot(robot, **chosen).to_mjspec().compile()
    assert model.joint(joint).margin.item() == margin
