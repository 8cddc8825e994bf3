"""Grippers and arms of users' MJCF files, and grippers alone in a world."""

import mujoco
import numpy as np
import pytest

from wbc_suite.compat.robosuite.models.grippers import (
    GRIPPER_MAPPING,
    GripperModel,
    PandaGripper,
    register_gripper,
)
from wbc_suite.compat.robosuite.models.grippers.tester import GripperTester
from wbc_suite.compat.robosuite.models.robots import (
    REGISTERED_ROBOTS,
    ManipulatorModel,
)
from wbc_suite.compat.robosuite.robots import ROBOT_CLASS_MAPPING, register_robot_class
from wbc_suite.errors import ConfigError

CLAW = """
<mujoco><compiler angle="radian"/><worldbody><body name="palm">
  <geom name="palm" type="box" size="0.03 0.06 0.02" pos="0 0 0.02" mass="0.4"/>
  <site name="grip_site" pos="0 0 0.08"/>
  <body name="left" pos="0 0.05 0.04">
    <joint name="left_slide" type="slide" axis="0 1 0" range="-0.045 0" damping="20"/>
    <geom name="left_pad" type="box" size="0.01 0.005 0.03" pos="0 0 0.03" mass="0.05"
      friction="2 0.05 0.001"/>
  </body>
  <body name="right" pos="0 -0.05 0.04">
    <joint name="right_slide" type="slide" axis="0 1 0" range="0 0.045" damping="20"/>
    <geom name="right_pad" type="box" size="0.01 0.005 0.03" pos="0 0 0.03" mass="0.05"
      friction="2 0.05 0.001"/>
  </body>
</body></worldbody><actuator>
  <position name="l" joint="left_slide" kp="2000" ctrlrange="-0.045 0"/>
  <position name="r" joint="right_slide" kp="2000" ctrlrange="0 0.045"/>
</actuator></mujoco>
"""


def _arm():
    """Return a file of an arm with five joints, 0.3 m apart, about y and z."""
    head = '<mujoco><compiler angle="radian"/><worldbody><body name="foot">'
    head += '<geom type="cylinder" size="0.06 0.05" pos="0 0 0.05" mass="3"/>'
    text, motors, tail = head, "", ""
    for k, axis in enumerate(("0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0")):
        text += f'<body name="link{k}" pos="0 0 {0.1 if k == 0 else 0.25}">'
        text += f'<joint name="turn{k}" axis="{axis}" range="-2.5 2.5" damping="1"/>'
        text += '<geom type="capsule" size="0.04" fromto="0 0 0.05 0 0 0.2" mass="1"/>'
        motors += f'<motor name="m{k}" joint="turn{k}" ctrlrange="-80 80"/>'
        tail += "</body>"
    text += (
        '<body name="right_hand" pos="0 0 0.25"><geom size="0.03" mass="0.1"/></body>'
    )
    return f"{text}{tail}</body></worldbody><actuator>{motors}</actuator></mujoco>"


class Claw(GripperModel):
    """A gripper written as robosuite's guide does."""

    file = ""

    def __init__(self, idn=0):
        super().__init__(self.file, idn=idn)

    def format_action(self, action):
        assert len(action) == self.dof
        step = np.array([-1.0, 1.0]) * self.speed * np.sign(action)
        self.current_action = np.clip(self.current_action + step, -1.0, 1.0)
        return self.current_action

    @property
    def init_qpos(self):
        return np.zeros(2)

    @property
    def speed(self):
        return 0.1

    @property
    def dof(self):
        return 1

    @property
    def _important_geoms(self):
        sides = {f"{side}_finger": [f"{side}_pad"] for side in ("left", "right")}
        return sides | {f"{k}pad": v for k, v in sides.items()}


class FiveTurns(ManipulatorModel):
    """An arm written as robosuite's guide does."""

    arms = ("right",)  # pyright: ignore - as robosuite's guide has it
    path = ""

    def __init__(self, idn=0):
        super().__init__(self.path, idn=idn)
        self.set_joint_attribute("armature", values=np.full(5, 0.3))

    @property
    def default_base(self):
        return "RethinkMount"

    @property
    def default_gripper(self):
        return {"right": "Claw"}

    @property
    def init_qpos(self):
        return np.array([0.0, 0.4, 1.4, 0.0, 1.2])


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    (folder / "claw.xml").write_text(CLAW)
    (folder / "arm.xml").write_text(_arm())
    Claw.file, FiveTurns.path = str(folder / "claw.xml"), str(folder / "arm.xml")
    register_gripper(Claw)
    register_robot_class("FixedBaseRobot")(FiveTurns)
    yield Claw, FiveTurns
    for known in (GRIPPER_MAPPING, ROBOT_CLASS_MAPPING, REGISTERED_ROBOTS):
        known.pop("Claw", None)
        known.pop("FiveTurns", None)


def test_models_are_the_files_with_a_prefix(files):
    claw = files[0]()
    model = claw.get_model()
    assert model.nu == 2
    assert (
        mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, "gripper0_left_slide") >= 0
    )
    assert claw.joints == ["gripper0_left_slide", "gripper0_right_slide"]
    arm = files[1]()
    assert arm.tree.getroot().find(".//body[@name='robot0_right_hand']") is not None
    assert arm.eef_name == {"right": "robot0_right_hand"}
    armatures = [arm.description.joint(f"turn{k}").armature for k in range(5)]
    np.testing.assert_allclose(armatures, 0.3)


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["Panda", "FiveTurns"])
def test_a_gripper_of_a_file_closes_on_an_arm(suite, files, robot):
    env = suite.make("Lift", robots=robot, gripper_types="Claw", use_camera_obs=False)
    seen = env.reset()
    opened = seen["robot0_gripper_qpos"]
    hand = env.robots[0].gripper["right"]
    assert type(hand) is files[0]
    assert hand.important_geoms["left_fingerpad"] == ["gripper0_right_left_pad"]
    assert hand.joints == ["gripper0_right_left_slide", "gripper0_right_right_slide"]
    action = np.zeros(env.action_dim)
    action[-1] = 1.0
    for _ in range(20):
        seen, *_ = env.step(action)
    np.testing.assert_allclose(opened, 0.0, atol=1e-3)
    np.testing.assert_allclose(seen["robot0_gripper_qpos"], (-0.045, 0.045), atol=2e-3)


@pytest.mark.slow
def test_an_arm_of_a_file_starts_and_moves_as_told(suite, files):
    part = suite.load_part_controller_config(default_controller="JOINT_POSITION")
    part["gripper"] = {"type": "GRIP"}
    config = {"type": "BASIC", "body_parts": {"right": part}}
    env = suite.make(
        "Lift",
        robots="FiveTurns",
        controller_configs=config,
        initialization_noise=None,
        use_camera_obs=False,
    )
    seen = env.reset()
    np.testing.assert_allclose(seen["robot0_joint_pos"], (0.0, 0.4, 1.4, 0.0, 1.2))
    assert env.action_dim == 6
    for _ in range(20):
        seen, *_ = env.step(np.array([0.5, 0, 0, 0, 0, 0]))
    assert seen["robot0_joint_pos"][0] > 0.05
    assert abs(seen["robot0_joint_pos"][3]) < 0.05


def test_a_gripper_without_servos_is_refused(suite, files, tmp_path):
    text = CLAW.replace("<position", "<motor").replace('kp="2000" ', "")
    (tmp_path / "loose.xml").write_text(text)

    class Loose(files[0]):
        """Its fingers have motors."""

        def __init__(self, idn=0):
            GripperModel.__init__(self, str(tmp_path / "loose.xml"), idn)

    GRIPPER_MAPPING["Loose"] = Loose
    with pytest.raises(ConfigError, match="position actuators"):
        suite.make("Lift", robots="Panda", gripper_types="Loose")
    del GRIPPER_MAPPING["Loose"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "low", "high", "more"),
    [
        ("PandaGripper", -0.10, 0.01, {}),
        ("RethinkGripper", -0.07, 0.02, {}),
        ("Robotiq85Gripper", -0.045, 0.02, {"box_size": [0.025] * 3}),
        ("Robotiq140Gripper", 0.02, 0.10, {"box_size": [0.025] * 3}),
        (
            "RobotiqThreeFingerGripper",
            *(-0.02, 0.10),
            {"box_size": [0.035] * 3, "box_density": 500},
        ),
        (
            "JacoThreeFingerGripper",
            *(0.01, 0.10),
            {"box_size": [0.025] * 3, "step_time": 1000},
        ),
    ],
)
def test_grippers_lift_a_box_as_robosuite_tests_them(name, low, high, more):
    at = {"pos": "0 0 0.3", "quat": "0 0 1 0", "render": False}
    gripper = GRIPPER_MAPPING[name]()
    tester = GripperTester(
        gripper, gripper_low_pos=low, gripper_high_pos=high, **at, **more
    )
    with pytest.raises(RuntimeError, match="start_simulation"):
        tester.step()
    tester.start_simulation()
    tester.loop(total_iters=1, test_y=True)
    assert tester.object_height > 0.01


def test_a_tester_wants_low_below_high():
    with pytest.raises(ValueError, match="is above"):
        GripperTester(PandaGripper(), "0 0 0.3", "0 0 1 0", 0.1, 0.0)


@pytest.mark.parametrize("name", [n for n in GRIPPER_MAPPING if n is not None])
def test_actions_of_a_gripper_are_positions_of_its_actuators(name):
    gripper = GRIPPER_MAPPING[name]()
    assert len(gripper.init_qpos) == len(gripper.joints)
    for _ in range(200):
        closed = gripper.format_action([1] * gripper.dof)
    assert closed.shape == (len(gripper.actuators),)
    assert set(np.abs(closed).round(9).tolist()) <= {0.0, 1.0}
