"""Hands know the links of their grippers, and whether two of them touch an object."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.control import RobotState
from wbc_suite.scene import attach_robot, compile_scene, empty_arena
from wbc_suite.scene.objects import ObjectState, box
from wbc_suite.sensing.hands import gripper_links, hands_of, pairs_in_contact
from wbc_suite.sensing.segmentation import Labels, SegmentationLevel


@pytest.fixture(scope="module")
def scene():
    """Return a Panda at rest with its gripper open, and a cube."""
    spec, robot = empty_arena(), wbc_suite.load_robot("Panda")
    box("cube", (0.02, 0.02, 0.02)).add_to(spec)
    attach_robot(spec, robot, "robot0_")
    model = compile_scene(spec)
    data = mujoco.MjData(model)
    state = RobotState(model, data, robot, prefix="robot0_")
    for name, value in robot.keyframe("ready").items():
        data.joint(f"robot0_{name}").qpos[0] = value
    mujoco.mj_forward(model, data)
    return model, data, state


def grip(scene, half_opening, aside=(0.0, 0.0)):
    """Put the cube between the fingers, aside by so much along x and y of the hand."""
    model, data, state = scene
    (hand,) = hands_of(state)
    site = data.site("robot0_" + hand.frame)
    for joint in ("panda_finger_joint1", "panda_finger_joint2"):
        data.joint(f"robot0_{joint}").qpos[0] = half_opening
    R = site.xmat.reshape(3, 3)
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, site.xmat)
    cube = ObjectState(model, data, "cube")
    place = site.xpos + R @ np.array([*aside, 0.0])
    cube.move(place.tolist(), tuple(quat))
    mujoco.mj_forward(model, data)
    return hand, cube


def test_the_gripper_is_the_hand_and_its_fingers(scene):
    robot = scene[2].robot
    (side, frame), *rest = robot.hands.items()
    links = gripper_links(robot, side, frame)
    assert not rest
    assert {"panda_leftfinger", "panda_rightfinger", "panda_hand"} <= set(links)
    assert "panda_link6" not in links


def test_slip_is_the_speed_of_a_body_in_the_frame_of_the_hand(scene):
    model, data, _ = scene
    hand, cube = grip(scene, 0.0195, aside=(0.03, 0.05))
    rng = np.random.default_rng(0)
    data.qvel[:] = rng.normal(0.0, 1.0, model.nv)
    mujoco.mj_forward(model, data)
    found, places = hand.slip(cube.body), []
    for _ in range(2):
        R = data.site_xmat[hand.site].reshape(3, 3)
        places.append(R.T @ (data.xipos[cube.body] - hand.position))
        mujoco.mj_integratePos(model, data.qpos, data.qvel, 1e-6)
        mujoco.mj_kinematics(model, data)
    data.qvel[:] = 0.0
    speed = np.linalg.norm(places[1] - places[0]) / 1e-6
    assert found == pytest.approx(speed, rel=1e-4)
    assert found > 0.5


def test_two_fingers_on_a_cube_are_a_grasp(scene):
    hand, cube = grip(scene, 0.0195)
    assert hand.grasps(cube.geoms)
    assert len(pairs_in_contact(scene[1])) >= 2


def test_one_finger_or_none_is_no_grasp(scene):
    hand, cube = grip(scene, 0.04)
    assert not hand.grasps(cube.geoms)
    hand, cube = grip(scene, 0.04, aside=(0.0, 0.0205))
    touching = {g for pair in pairs_in_contact(scene[1]) for g in pair}
    assert touching & cube.geoms  # it touches one finger
    assert not hand.grasps(cube.geoms)


def test_a_grasp_is_one_of_the_given_geoms(scene):
    hand, cube = grip(scene, 0.0195)
    floor = {scene[0].geom("floor").id}
    assert not hand.grasps(floor)
    assert hand.grasps(cube.geoms | floor)


def test_a_hand_owns_the_geoms_of_its_gripper(scene):
    model = scene[0]
    (hand,) = hands_of(scene[2])
    for geom in range(model.ngeom):
        body = model.body(int(model.geom_bodyid[geom])).id
        assert hand.owns(geom) is (body in hand.gripper_bodies)


def test_positions_of_hands_follow_the_simulation(scene):
    model, data, state = scene
    (hand,) = hands_of(state)
    before = hand.position.copy()
    data.joint("robot0_panda_joint1").qpos[0] += 0.5
    mujoco.mj_forward(model, data)
    moved = hand.position
    np.testing.assert_allclose(np.linalg.norm(moved[:2]), np.linalg.norm(before[:2]))
    assert np.linalg.norm(moved - before) > 0.1
    data.joint("robot0_panda_joint1").qpos[0] -= 0.5
    mujoco.mj_forward(model, data)


def test_no_contact_is_an_empty_list():
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    assert pairs_in_contact(mujoco.MjData(model)) == []


def test_labels_tell_robot_gripper_and_object_apart(scene):
    model, _, state = scene
    labels = Labels(model, [state])
    instances = labels.names[SegmentationLevel.INSTANCE]
    assert {"robot0", "robot0_right_gripper", "cube"} <= set(instances.values())
    assert set(labels.names[SegmentationLevel.CLASS].values()) >= {
        *("Panda", "gripper", "cube")
    }
    of = labels.numbers[SegmentationLevel.INSTANCE]
    assert of.shape == (model.ngeom + 1,)
    assert of[-1] == 0
    for geom in range(model.ngeom):
        body = model.body(int(model.geom_bodyid[geom])).name
        name = instances[int(of[geom])]
        assert name.startswith("robot0") is body.startswith("robot0_")


def test_every_geom_is_an_element_of_its_own(scene):
    model, _, state = scene
    labels = Labels(model, [state])
    numbers = labels.numbers[SegmentationLevel.ELEMENT]
    assert sorted(numbers[:-1]) == [*range(1, model.ngeom + 1)]
    assert labels.numbers[SegmentationLevel.ELEMENT].max() == model.ngeom
    assert labels.numbers[SegmentationLevel.INSTANCE].max() < model.ngeom


@pytest.mark.parametrize(
    ("bodies", "classes"),
    [
        (("cubeA", "cubeB"), {"cube"}),
        (("cup1", "cup_2", "plate"), {"cup", "plate"}),
        (("A", "B"), {"A", "B"}),
        (("TVs", "4"), {"TVs", "4"}),
    ],
)
def test_classes_leave_numbers_and_capitals_at_the_end_out(bodies, classes):
    xml = "".join(f"<body name='{b}'><geom size='1'/></body>" for b in bodies)
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{xml}</worldbody></mujoco>"
    )
    found = Labels(model, []).names[SegmentationLevel.CLASS].values()
    assert set(found) == classes


def grip_turned(scene, turn, aside=(0.0, 0.0), half_opening=None):
    """Put the cube between the fingers, turned about the hand's axis."""
    model, data, _ = scene
    width = 0.02 * (np.cos(turn) + np.sin(turn))
    hand, cube = grip(scene, half_opening or width - 0.0005, aside=aside)
    turned = pin.Quaternion(pin.exp3(np.array([0.0, 0.0, turn])))
    quat = np.empty(4)
    about = np.array([turned.w, turned.x, turned.y, turned.z])
    mujoco.mju_mulQuat(quat, data.joint("cube_joint").qpos[3:].copy(), about)
    cube.move(data.joint("cube_joint").qpos[:3].copy(), tuple(quat))
    mujoco.mj_forward(model, data)
    return hand, cube


@pytest.mark.parametrize(
    ("turn", "friction", "bears"),
    [
        pytest.param(0.0, 1.0, True, id="faces"),
        pytest.param(0.0, 0.5, True, id="smooth-faces"),
        pytest.param(0.5, 1.0, True, id="corners"),
        pytest.param(0.5, 0.2, False, id="smooth-corners"),
    ],
)
def test_a_grip_bears_a_load_if_lines_between_contacts_are_in_the_friction_cones(
    scene, turn, friction, bears
):
    """Two corners of a turned square are 45 degrees - turn beside the normals."""
    model = scene[0]
    was = model.geom_friction.copy()
    model.geom_friction[:, 0] = friction
    hand, cube = grip_turned(scene, turn)
    model.geom_friction[:] = was
    assert hand.grasps(cube.geoms)
    assert hand.bears(cube.geoms, 0.1) == bears


def test_a_grip_bears_less_than_its_friction_and_no_more(scene):
    model, data, _ = scene
    hand, cube = grip(scene, 0.0195)
    force, total = np.zeros(6), 0.0
    for k, pair in enumerate(pairs_in_contact(data)):
        if not cube.geoms.isdisjoint(pair):
            mujoco.mj_contactForce(model, data, k, force)
            total += force[0]
    mu = max(model.geom_friction[g, 0] for g in cube.geoms)
    assert total > 1.0
    assert hand.bears(cube.geoms, 0.5 * mu * total)
    assert not hand.bears(cube.geoms, 1.01 * mu * total)


def test_a_finger_on_one_side_bears_nothing(scene):
    hand, cube = grip(scene, 0.04, aside=(0.0, 0.0205))
    assert not hand.bears(cube.geoms, 0.01)


def test_spin_is_the_angular_speed_in_the_frame_of_the_hand(scene):
    model, data, _ = scene
    hand, cube = grip(scene, 0.0195)
    data.joint("cube_joint").qvel[3:] = 0.0, 2.0, 0.0
    mujoco.mj_forward(model, data)
    assert hand.spin(cube.body) == pytest.approx(2.0)
    data.qvel[:] = 0.0
    data.joint("robot0_panda_joint7").qvel[0] = -0.5
    mujoco.mj_forward(model, data)
    assert hand.spin(cube.body) == pytest.approx(0.5)
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
