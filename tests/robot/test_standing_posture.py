"""A quadruped and a biped in plain URDF stand in the inferred posture."""

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.robot.urdf_import import read_urdf

LINK = """<link name="{name}"><inertial><origin xyz="0 0 {z}"/><mass value="{mass}"/>
  <inertia ixx="{i}" ixy="0" ixz="0" iyy="{i}" iyz="0" izz="{i}"/></inertial>
  <collision><origin xyz="{x} 0 {z}"/><geometry>{shape}</geometry></collision></link>"""
JOINT = """<joint name="{name}" type="{kind}"><parent link="{parent}"/>
  <child link="{child}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/>
  <limit lower="{low}" upper="{high}" effort="40" velocity="20"/></joint>"""
BAR = '<cylinder radius="0.015" length="0.12"/>'


def link(name, mass, shape, *, x=0.0, z=0.0):
    return LINK.format(name=name, mass=mass, i=mass * 0.002, shape=shape, x=x, z=z)


def joint(
    name, parent, child, xyz, *, axis="0 1 0", low=-3.0, high=3.0, kind="revolute"
):
    return JOINT.format(
        name=name, parent=parent, child=child, xyz=xyz, axis=axis, low=low, high=high,
        kind=kind,
    )  # fmt: skip


def dog():
    """Thighs and shanks of 0.2 m; knees cannot be straight, as a real one's."""
    parts = [link("trunk", 8.0, '<box size="0.4 0.2 0.1"/>')]
    for end, x in (("F", 0.2), ("R", -0.2)):
        for side, y in (("L", 0.1), ("R", -0.1)):
            leg = end + side
            parts += [
                link(f"{leg}_hip", 0.5, '<sphere radius="0.03"/>'),
                link(f"{leg}_thigh", 0.5, BAR, z=-0.1),
                link(f"{leg}_calf", 0.2, BAR, z=-0.1),
                link(f"{leg}_foot", 0.05, '<sphere radius="0.02"/>'),
                joint(f"{leg}_hip_joint", "trunk", f"{leg}_hip", f"{x} {y} 0",
                      axis="1 0 0"),
                joint(f"{leg}_thigh_joint", f"{leg}_hip", f"{leg}_thigh",
                      f"0 {y / 2} 0"),
                joint(f"{leg}_calf_joint", f"{leg}_thigh", f"{leg}_calf", "0 0 -0.2",
                      low=-2.6, high=-0.9),
                joint(f"{leg}_foot_fixed", f"{leg}_calf", f"{leg}_foot", "0 0 -0.2",
                      kind="fixed"),
            ]  # fmt: skip
    return f'<robot name="dog">{"".join(parts)}</robot>'


def human():
    """Legs of hip, knee and ankle; the left knee turns about -y."""
    parts = [link("pelvis", 10.0, '<box size="0.1 0.2 0.1"/>')]
    for side, y, way in (("left", 0.1, -1), ("right", -0.1, 1)):
        knee = (-2.0, 0.1) if way < 0 else (-0.1, 2.0)
        axis = f"0 {way} 0"
        parts += [
            link(f"{side}_thigh", 2.0, BAR, z=-0.2),
            link(f"{side}_shin", 1.5, BAR, z=-0.2),
            link(f"{side}_foot", 0.5, '<box size="0.2 0.08 0.02"/>', x=0.04, z=-0.05),
            joint(f"{side}_hip", "pelvis", f"{side}_thigh", f"0 {y} 0"),
            joint(f"{side}_knee", f"{side}_thigh", f"{side}_shin", "0 0 -0.4",
                  axis=axis, low=knee[0], high=knee[1]),
            joint(f"{side}_ankle", f"{side}_shin", f"{side}_foot", "0 0 -0.4"),
        ]  # fmt: skip
    return f'<robot name="human">{"".join(parts)}</robot>'


def read(folder, text):
    path = folder / "robot.urdf"
    path.write_text(text)
    return read_urdf(path)


def places(robot, names):
    """Return where links are in the posture ready, pin.SE3 each."""
    model = robot.to_pinocchio()
    data, q = model.createData(), pin.neutral(model)
    for name, value in robot.keyframe("ready").items():
        q[model.joints[model.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(model, data, q)
    return [data.oMf[model.getFrameId(name)] for name in names]


def test_a_dogs_feet_are_below_its_thighs(tmp_path):
    robot = read(tmp_path, dog())
    for leg in ("FL", "FR", "RL", "RR"):
        thigh, foot = places(robot, [f"{leg}_thigh", f"{leg}_foot"])
        down = foot.translation - thigh.translation
        np.testing.assert_allclose(down, [0.0, 0.0, -0.34], atol=1e-3)
        assert -2.5 < robot.keyframe("ready")[f"{leg}_calf_joint"] < -1.0


def test_a_humans_soles_are_level_and_its_knees_point_forward(tmp_path):
    robot = read(tmp_path, human())
    for side in ("left", "right"):
        thigh, shin, foot = places(
            robot, [f"{side}_{n}" for n in ("thigh", "shin", "foot")]
        )
        down = foot.translation - thigh.translation
        np.testing.assert_allclose(down, [0.0, 0.0, -0.76], atol=1e-3)
        np.testing.assert_allclose(foot.rotation, np.eye(3), atol=1e-3)
        assert shin.translation[0] > thigh.translation[0] + 0.05


def test_rounded_angles_stay_within_limits(tmp_path):
    angle = read(tmp_path, human()).keyframe("ready")["right_ankle"]
    tight = human().replace('lower="-3.0"', f'lower="{angle + 3e-5}"')
    ready = read(tmp_path, tight).keyframe("ready")
    assert ready["right_ankle"] == pytest.approx(angle + 3e-5, abs=1e-9)


def test_frames_of_soles_are_level_and_turned_ones_stay(tmp_path):
    turned = joint("s", "left_foot", "left_sole", "0 0 -0.06", kind="fixed")
    turned = turned.replace('xyz="0 0 -0.06"', 'xyz="0 0 -0.06" rpy="1.5 0 0.4"')
    text = human().replace("</robot>", f'<link name="left_sole"/>{turned}</robot>')
    robot = read(tmp_path, text)
    feet = [frame.name for frame in robot.frames if frame.role == "foot"]
    assert len(feet) == 2
    for foot, sole in zip(feet, places(robot, feet), strict=True):
        np.testing.assert_allclose(sole.rotation, np.eye(3), atol=1e-3, err_msg=foot)
    (given,) = places(robot, ["left_sole"])
    expected = pin.rpy.rpyToMatrix(1.5, 0.0, 0.4)
    np.testing.assert_allclose(given.rotation, expected, atol=1e-3)
    (left,) = places(robot, [name for name in feet if "left" in name])
    np.testing.assert_allclose(left.translation, given.translation, atol=1e-9)


def test_legs_that_cannot_stand_so_stay_near_zero(tmp_path):
    stiff = dog().replace('lower="-3.0" upper="3.0"', 'lower="-0.1" upper="0.1"')
    ready = read(tmp_path, stiff).keyframe("ready")
    assert ready["FL_thigh_joint"] == 0.0
    assert ready["FL_calf_joint"] == -0.9


@pytest.mark.slow
def test_a_dog_let_go_stands_and_moves_its_body(tmp_path):
    read(tmp_path, dog())
    robot = wbc_suite.load_robot(tmp_path / "robot.urdf", root="free")
    env = wbc_suite.make(
        "Lift", robots=robot, controller_configs="WHOLE_BODY_IK", control_freq=50
    )
    env.reset(seed=0)
    base = env.unwrapped
    trunk = base.simulation.data.body("robot0_trunk")
    start, action = trunk.xpos.copy(), base.hold_action.copy()
    for step in range(200):
        if step == 50:
            action[:3] += [0.03, 0.02, -0.04]
        env.step(action)
    assert trunk.xmat[8] > np.cos(np.radians(2.0))
    np.testing.assert_allclose(trunk.xpos - start, [0.03, 0.02, -0.04], atol=5e-3)
    assert not any(int(w.number) for w in base.simulation.data.warning)
    env.close()


def test_legs_on_wheels_stand_on_these(tmp_path):
    text = dog().replace("_foot", "_wheel")
    for leg in ("FL", "FR", "RL", "RR"):
        text = text.replace(
            f'name="{leg}_wheel_fixed" type="fixed"',
            f'name="{leg}_wheel_joint" type="continuous"',
        )
    robot = read(tmp_path, text)
    feet = {frame.link for frame in robot.frames if frame.role == "foot"}
    assert feet == {f"{leg}_wheel" for leg in ("FL", "FR", "RL", "RR")}
    ready = robot.keyframes["ready"]
    assert robot.root.kind == "free"
    assert ready["FL_calf_joint"] < -0.9 < 0.0 == ready["FL_wheel_joint"]


SOLE = np.array([(x, y, -0.06) for x in (-0.06, 0.14) for y in (-0.04, 0.04)])
"""Lower corners of the box of a foot of `human` in the axes of its link."""


@pytest.mark.parametrize("pitch", [0.2, -0.15])
def test_soles_are_flat_where_the_file_has_tilted_feet(tmp_path, pitch):
    """At zero the ankle of the file holds the foot pitched, as in Berkeley's Lite."""
    text = human()
    for side in ("left", "right"):
        plain = joint(f"{side}_ankle", f"{side}_shin", f"{side}_foot", "0 0 -0.4")
        assert plain in text
        turned = plain.replace('xyz="0 0 -0.4"', f'xyz="0 0 -0.4" rpy="0 {pitch} 0"')
        text = text.replace(plain, turned)
    assert_flat(read(tmp_path, text))


@pytest.mark.parametrize("tilt", [0.0, 0.5])
def test_a_tilted_hip_bends_too_and_its_other_joints_keep_the_sole_flat(tmp_path, tilt):
    """Unitree's H2 has the axis of its hips 30 degrees off."""
    text = human()
    for side, way in (("left", 1), ("right", -1)):
        axis = f"0 {np.cos(tilt)} {way * np.sin(tilt)}"
        plain = joint(f"{side}_hip", "pelvis", f"{side}_thigh", f"0 {way * 0.1} 0")
        assert plain in text
        parts = [
            joint(f"{side}_hip", "pelvis", f"{side}_h1", f"0 {way * 0.1} 0", axis=axis),
            link(f"{side}_h1", 0.5, '<sphere radius="0.03"/>'),
            joint(f"{side}_roll", f"{side}_h1", f"{side}_h2", "0 0 0", axis="1 0 0"),
            link(f"{side}_h2", 0.5, '<sphere radius="0.03"/>'),
            joint(f"{side}_yaw", f"{side}_h2", f"{side}_thigh", "0 0 0", axis="0 0 1"),
        ]
        text = text.replace(plain, "".join(parts))
    robot = read(tmp_path, text)
    ready = robot.keyframe("ready")
    for side in ("left", "right"):
        assert abs(ready[f"{side}_knee"]) > 0.4
        assert abs(ready[f"{side}_hip"]) > 0.2
        if tilt == 0.0:
            assert ready[f"{side}_roll"] == ready[f"{side}_yaw"] == 0.0
    assert_flat(robot)


def assert_flat(robot):
    """Corners of the soles are level, below the hips, by Pinocchio."""
    model = robot.to_pinocchio()
    data = model.createData()
    q = pin.neutral(model)
    for name, value in robot.keyframe("ready").items():
        q[model.joints[model.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(model, data, q)
    for side, y in (("left", 0.1), ("right", -0.1)):
        foot = data.oMf[model.getFrameId(f"{side}_foot")]
        heights = (SOLE @ foot.rotation.T)[:, 2]
        assert np.ptp(heights) < 2e-3
        np.testing.assert_allclose(foot.translation[:2], (0.0, y), atol=0.03)
