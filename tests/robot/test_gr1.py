"""Fourier GR1: data sheet, postures, contacts, standing, hands, left against right."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import wbc_suite

VARIANTS = {  # independent joints; the data sheet counts 44
    "GR1": 44,
    "GR1FreeBody": 44,
    "GR1FixedLowerBody": 32,
    "GR1FloatingBody": 32,
    "GR1ArmsOnly": 26,
}


@pytest.fixture(scope="module", params=VARIANTS)
def variant(request):
    return wbc_suite.load_robot(request.param)


@pytest.fixture(scope="module")
def robot():
    return wbc_suite.load_robot("GR1")


def at(robot, values, *, floor=False):
    """Compile the robot and put it into a posture."""
    spec = robot.to_mjspec()
    if floor:
        spec.worldbody.add_geom(
            name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.1]
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    for name, value in values.items():
        data.joint(name).qpos[:] = value
    mujoco.mj_forward(model, data)
    return model, data


def touching(model, data):
    """Pairs of bodies in contact."""
    return {
        tuple(sorted(model.body(model.geom_bodyid[g]).name for g in contact.geom))
        for contact in data.contact[: data.ncon]
    }


def random_posture(robot, rng):
    values = {j.name: rng.uniform(*j.range) for j in robot.joints if not j.mimic}
    for joint in robot.joints:
        if joint.mimic:
            value = joint.mimic.ratio * values[joint.mimic.joint]
            values[joint.name] = float(np.clip(value, *joint.range))
    return values


def test_mass_and_joints_are_those_of_the_data_sheet(variant):
    assert variant.mass == pytest.approx(55.0, rel=0.02)
    assert variant.dof == VARIANTS[variant.name]


def test_every_moving_joint_has_limits(robot):
    for joint in robot.joints:
        assert joint.range, joint.name
        assert joint.velocity, joint.name
        assert joint.mimic or joint.effort, joint.name
        assert joint.armature > 0, joint.name


def test_nothing_touches_at_zero_or_ready(variant):
    zero = {j.name: float(np.clip(0.0, *j.range)) for j in variant.joints}
    for values in (zero, variant.keyframe("ready")):
        assert not touching(*at(variant, values))


def test_no_two_links_always_touch(robot):
    rng = np.random.default_rng(3)
    model, data = at(robot, {})
    always = None
    for _ in range(100):
        for name, value in random_posture(robot, rng).items():
            data.joint(name).qpos[:] = value
        mujoco.mj_forward(model, data)
        now = touching(model, data)
        always = now if always is None else always & now
    assert not always


def test_ready_keeps_away_from_the_limits(robot):
    ready = robot.keyframe("ready")
    for joint in robot.joints:
        low, high = joint.range
        margin = min(ready[joint.name] - low, high - ready[joint.name])
        assert margin > 0.04 * (high - low), joint.name


def test_soles_meet_the_floor_below_the_centre_of_mass():
    robot = wbc_suite.load_robot("GR1FreeBody")
    model, data = at(robot, {})
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    feet = [data.site(f"{side}_foot") for side in ("left", "right")]
    for foot in feet:
        assert foot.xpos[2] == pytest.approx(0.0, abs=1e-4)
        np.testing.assert_allclose(foot.xmat.reshape(3, 3), np.eye(3), atol=1e-9)
    com = data.subtree_com[0]
    assert feet[1].xpos[1] < com[1] < feet[0].xpos[1]
    heel, toes = -0.058, 0.128  # the sole's two bars, in the foot's frame
    assert heel + 0.04 < com[0] - feet[0].xpos[0] < toes - 0.04


@pytest.mark.slow
def test_free_robot_stands_on_its_soles_under_a_joint_law():
    """Joint PD and gravity torques hold it for 5 s.

    The body is an inverted pendulum of m g h = 450 N m/rad, and hip, knee and ankle are
    springs in series: at 1500 N m/rad each, two legs give 1000.
    """
    robot = wbc_suite.load_robot("GR1FreeBody")
    model, data = at(robot, {}, floor=True)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    mujoco.mj_resetDataKeyframe(model, data, 0)
    start = data.qpos.copy()
    joints = [model.joint(int(j)) for j in model.actuator_trnid[:, 0]]
    qpos = np.array([j.qposadr[0] for j in joints])
    dof = np.array([j.dofadr[0] for j in joints])
    motor = model.actuator_biastype == mujoco.mjtBias.mjBIAS_NONE
    limit = model.actuator_forcerange[:, 1]
    legs = np.isin([j.name for j in joints], robot.group("legs"))
    ankles = np.array(["ankle" in j.name for j in joints])
    kp = np.where(legs, 1500.0, 10.0 * limit)
    kd = np.where(ankles, 8.0, kp / 40.0)
    for _ in range(2500):
        torque = kp * (start - data.qpos)[qpos] - kd * data.qvel[dof]
        torque = np.clip(torque + data.qfrc_bias[dof], -limit, limit)
        data.ctrl[:] = np.where(motor, torque, start[qpos])
        mujoco.mj_step(model, data)
    assert data.time == pytest.approx(5.0, abs=0.01)
    assert np.abs(data.qpos[:3] - start[:3]).max() < 0.03
    assert data.body("base_link").xmat[8] > np.cos(np.radians(3))
    assert touching(model, data) == {
        ("left_foot_roll_link", "world"), ("right_foot_roll_link", "world")
    }  # fmt: skip
    assert not data.warning.number.any()


@pytest.mark.parametrize("side", ["right", "left"])
def test_hand_closes_and_opens_within_half_a_second(side):
    hand = wbc_suite.load_robot("GR1ArmsOnly")
    model, data = at(hand, {})
    model.opt.gravity[:] = 0
    mujoco.mj_resetDataKeyframe(model, data, 0)
    fingers = ["index", "middle", "ring", "pinky"]
    for posture in ("closed", "open"):
        for synergy in hand.synergies[f"{side}_gripper"]:
            if synergy.name in fingers:
                for joint, value in getattr(synergy, posture).items():
                    data.actuator(joint).ctrl[0] = value
        mujoco.mj_step(model, data, 250)
        for finger in fingers:
            curl = f"{side[0].upper()}_{finger}"
            root = data.joint(f"{curl}_proximal_joint").qpos[0]
            assert (root < -1.35) if posture == "closed" else (root > -0.25)
            outer = data.joint(f"{curl}_intermediate_joint").qpos[0]
            assert outer == pytest.approx(0.975 * root, abs=0.03)


def test_closed_hand_squeezes_a_ball():
    """The fist stops on a ball and the fingers push with a part of their effort."""
    hand = wbc_suite.load_robot("GR1ArmsOnly")
    spec = hand.to_mjspec()
    tcp = next(s for s in spec.sites if s.name == "right_tcp")
    tcp.parent.add_geom(
        name="ball",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[0.025, 0, 0],
        pos=tcp.pos,
        mass=0,
    )
    model = spec.compile()
    model.opt.gravity[:] = 0
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    for synergy in hand.synergies["right_gripper"]:
        for joint, value in synergy.closed.items():
            if "thumb" not in joint:
                data.actuator(joint).ctrl[0] = value
    mujoco.mj_step(model, data, 500)
    force = np.zeros(6)
    squeeze = 0.0
    for index, contact in enumerate(data.contact[: data.ncon]):
        if model.geom("ball").id in contact.geom:
            mujoco.mj_contactForce(model, data, index, force)
            squeeze += force[0]
    assert squeeze > 5.0


def test_left_and_right_are_reflections(robot):
    """In a posture that is its own mirror image, so are hands and feet.

    The vendor's two knees differ by 0.25 mm and the two elbows by 0.1 mm.
    """
    rng = np.random.default_rng(5)
    model = robot.to_pinocchio()
    data = model.createData()
    q = pin.neutral(model)
    for joint in robot.joints:
        if not joint.name.startswith("left_"):
            continue
        value = rng.uniform(*joint.range)
        kept = joint.axis[1] == pytest.approx(1.0)  # pitch; roll and yaw change sign
        other = joint.name.replace("left", "right")
        for name, number in ((joint.name, value), (other, value if kept else -value)):
            q[model.joints[model.getJointId(name)].idx_q] = number
    pin.framesForwardKinematics(model, data, q)
    mirror = np.diag([1.0, -1.0, 1.0])
    for frame in ("eef", "foot", "tcp"):
        left, right = (
            data.oMf[model.getFrameId(f"{side}_{frame}", pin.FrameType.OP_FRAME)]
            for side in ("left", "right")
        )
        np.testing.assert_allclose(
            right.translation, mirror @ left.translation, atol=3e-4
        )
        np.testing.assert_allclose(
            right.rotation, mirror @ left.rotation @ mirror, atol=1e-3
        )


def test_camera_in_the_head_sees_both_hands(robot):
    model, data = at(robot, robot.keyframe("ready"))
    camera = data.cam("head_camera")
    axes = camera.xmat.reshape(3, 3)
    half = np.tan(np.radians(model.cam("head_camera").fovy[0]) / 2)
    for side in ("right", "left"):
        x, y, z = axes.T @ (data.site(f"{side}_tcp").xpos - camera.xpos)
        assert z < 0
        assert max(abs(x / z) * 480 / 640, abs(y / z)) < half
