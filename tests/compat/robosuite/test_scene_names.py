"""Elements are shown with robosuite's names, and fingers are on robosuite's sides."""

import numpy as np
import pytest

from wbc_suite.compat.robosuite.models.grippers import GRIPPER_MAPPING

QUIET = {"use_camera_obs": False, "has_offscreen_renderer": False}

PADS = {
    "PandaGripper": ("panda_leftfinger", "panda_rightfinger"),
    "RethinkGripper": ("gripper_l_finger_tip", "gripper_r_finger_tip"),
    "Robotiq85Gripper": ("left_pad", "right_pad"),
    "Robotiq140Gripper": ("left_inner_finger_pad", "right_inner_finger_pad"),
    "XArm7Gripper": ("left_finger", "right_finger"),
    "JacoThreeFingerGripper": ("index_distal", "thumb_distal"),
    "InspireRightHand": ("R_thumb_distal", "R_index_intermediate"),
    "RobotiqThreeFingerGripper": ("finger_1_link_3", "finger_middle_link_3"),
    "BDGripper": ("jaw_palm", "arm_link_fngr"),
}
"""Links that touch an object from the left and from the right."""


@pytest.mark.parametrize("name", [name for name in GRIPPER_MAPPING if name])
def test_a_gripper_alone_has_joints_and_two_sides(name):
    gripper = GRIPPER_MAPPING[name]()
    geoms = gripper.important_geoms
    assert len(gripper.joints) == len(gripper.init_qpos)
    if name == "WipingGripper":
        return
    assert gripper.joints
    left, right = set(geoms["left_finger"]), set(geoms["right_finger"])
    assert left
    assert right
    assert not left & right
    assert set(geoms["left_fingerpad"]) <= left
    assert set(geoms["right_fingerpad"]) <= right
    for side, link in zip(("left", "right"), PADS.get(name, ()), strict=False):
        pads = geoms[f"{side}_fingerpad"]
        assert any(geom.startswith(f"gripper0_{link}_collision") for geom in pads)


@pytest.fixture
def lift(suite):
    made = []

    def make(robot):
        made.append(suite.make("Lift", robots=robot, seed=0, **QUIET))
        made[-1].reset()
        return made[-1]

    yield make
    for env in made:
        env.close()


NAMES = {
    "Panda": ("joint1", "torq_j1", "finger_joint1", "finger1_pad_collision"),
    "Sawyer": ("right_j0", "torq_right_j0", "l_finger_joint", "l_fingerpad_g0"),
    "IIWA": ("joint_1", "torq_j1", "finger_joint", "left_fingerpad_collision"),
    "Kinova3": ("Actuator1", "torq_j1", None, "left_fingerpad_collision"),
}
"""robosuite's names of the first joint of an arm, its motor, a finger, the left pad."""


@pytest.mark.slow
@pytest.mark.parametrize("robot", NAMES)
def test_names_are_robosuites(lift, robot):
    env = lift(robot)
    joint, motor, finger, pad = NAMES[robot]
    own, gripper, model = (
        env.robots[0].robot_model,
        env.robots[0].gripper,
        env.sim.model,
    )
    assert own.joints[0] == f"robot0_{joint}"
    assert own.actuators[0] == f"robot0_{motor}"
    assert own.eef_name == {"right": "robot0_right_hand"}
    gripper = gripper["right"]
    assert gripper.important_geoms["left_fingerpad"] == [f"gripper0_right_{pad}"]
    if finger is not None:
        assert gripper.joints[0] == f"gripper0_right_{finger}"
    for name in own.joints:
        assert model.joint_id2name(model.joint_name2id(name)) == name
        assert name in model.joint_names
    assert not set(own.contact_geoms) & set(gripper.contact_geoms)
    assert {"cube_main", "robot0_right_hand"} <= set(model.body_names)
    assert {"cube_g0", "table_collision"} <= set(model.geom_names)
    assert model.body_name2id("cube") == model.body_name2id("cube_main")


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["Sawyer", "Kinova3", "IIWA", "XArm7", "Jaco"])
def test_a_grasp_is_one_between_the_pads(lift, robot):
    env = lift(robot)
    gripper, cube = env.robots[0].gripper["right"], env.cube
    assert not env._check_grasp(gripper, cube)
    data = env.sim.data
    grip = data.get_site_xpos(gripper.important_sites["grip_site"]).copy()
    action = np.zeros(env.action_dim)
    action[-1] = 1.0
    for _ in range(40):
        data.set_joint_qpos("cube_joint0", [*grip, 1, 0, 0, 0])
        data.set_joint_qvel("cube_joint0", np.zeros(6))
        env.step(action)
    assert env._check_grasp(gripper, cube)
    names = {env.sim.model.geom_id2name(g) for g in data.contact.geom.ravel()}
    assert "cube_g0" in names
    assert env.get_contacts(cube) >= names & set(gripper.contact_geoms)


@pytest.mark.slow
def test_a_loop_of_ones_own_moves_as_a_step(lift):
    def path(own_loop):
        env = lift("Panda")
        action = np.array([0.0, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0])
        start = env.robots[0]._hand_pos["right"].copy()
        torques = []
        for _ in range(5):
            if not own_loop:
                env.step(action)
                continue
            for k in range(int(env.control_timestep / env.model_timestep)):
                env.sim.forward()
                env._pre_action(action, k == 0)
                env.sim.step()
                torques.append(env.robots[0].part_controllers["right"].torques)
        assert len({tuple(t) for t in torques}) == len(torques)
        return env.robots[0]._hand_pos["right"] - start

    own, step = path(True), path(False)
    assert step[1] > 0.01
    np.testing.assert_allclose(own, step, atol=1e-6)
