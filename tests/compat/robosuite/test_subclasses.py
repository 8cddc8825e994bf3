"""Classes of users: environments, objects, robots, devices and controllers."""

import numpy as np
import pytest

from wbc_suite.compat.robosuite.controllers import (
    CompositeController,
    register_composite_controller,
)
from wbc_suite.compat.robosuite.devices import Device
from wbc_suite.compat.robosuite.environments.manipulation import (
    Lift,
    ManipulationEnv,
    TwoArmEnv,
)
from wbc_suite.compat.robosuite.models.arenas import Arena, TableArena
from wbc_suite.compat.robosuite.models.objects import (
    BallObject,
    BoxObject,
    CapsuleObject,
    CylinderObject,
    MujocoGeneratedObject,
    MujocoXMLObject,
)
from wbc_suite.compat.robosuite.models.tasks import ManipulationTask
from wbc_suite.compat.robosuite.robots import ROBOT_CLASS_MAPPING
from wbc_suite.compat.robosuite.utils.mjcf_utils import (
    CustomMaterial,
    new_body,
    new_geom,
)
from wbc_suite.compat.robosuite.utils.observables import Observable, sensor
from wbc_suite.compat.robosuite.utils.placement_samplers import UniformRandomSampler
from wbc_suite.compat.robosuite.utils.robot_composition_utils import (
    create_composite_robot,
)
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import load_robot

TABLE = np.array((0.0, 0.0, 0.8))

BOTTLE = """
<mujoco><worldbody><body><body name="object">
  <geom name="base" type="cylinder" size="0.03 0.05" pos="0 0 0.05" density="300"/>
  <geom name="neck" type="capsule" size="0.012 0.02" pos="0 0 0.12" density="300"/>
  <site name="grip" pos="0 0 0.12"/>
</body>
<site name="bottom_site" pos="0 0 0"/>
<site name="top_site" pos="0 0 0.152"/>
<site name="horizontal_radius_site" pos="0.03 0 0"/>
</body></worldbody></mujoco>
"""

ROOM = """
<mujoco><worldbody>
  <light name="lamp" pos="0 0 3"/>
  <geom name="floor" type="plane" size="3 3 0.1"/>
  <body name="shelf" pos="0.2 0 0.4">
    <geom name="shelf" type="box" size="0.2 0.4 0.4"/>
  </body>
  <camera name="frontview" pos="2 0 1.5" xyaxes="0 1 0 -0.5 0 0.8"/>
</worldbody></mujoco>
"""


class PushCube(ManipulationEnv):
    """A cube is to be pushed forward; written as robosuite's guide does."""

    def __init__(self, robots, reward_shaping=False, **kwargs):
        self.table_full_size, self.table_offset = (0.8, 0.8, 0.05), TABLE
        self.reward_shaping, self.loads = reward_shaping, 0
        super().__init__(robots=robots, **kwargs)

    def reward(self, action=None):
        if self._check_success():
            return 1.0
        distance = self._gripper_to_target(
            self.robots[0].gripper, self.cube.root_body, "body", return_distance=True
        )
        return 1.0 - np.tanh(10.0 * distance) if self.reward_shaping else 0.0

    def _load_model(self):
        super()._load_model()
        self.loads += 1
        model = self.robots[0].robot_model
        model.set_base_xpos(model.base_xpos_offset["table"](self.table_full_size[0]))
        arena = TableArena(self.table_full_size, table_offset=self.table_offset)
        arena.set_origin([0, 0, 0])
        self.cube = BoxObject(
            name="brick",
            size_min=[0.02] * 3,
            size_max=[0.03] * 3,
            material=CustomMaterial("WoodRed", "redwood", "redwood_mat"),
            rng=self.rng,
        )
        self.placement_initializer = UniformRandomSampler(
            name="ObjectSampler",
            mujoco_objects=self.cube,
            x_range=[-0.03, 0.03],
            y_range=[-0.03, 0.03],
            rotation=None,
            ensure_object_boundary_in_range=False,
            reference_pos=self.table_offset,
            z_offset=0.01,
            rng=self.rng,
        )
        self.model = ManipulationTask(
            mujoco_arena=arena,
            mujoco_robots=[robot.robot_model for robot in self.robots],
            mujoco_objects=self.cube,
        )

    def _setup_references(self):
        super()._setup_references()
        self.cube_id = self.sim.model.body_name2id(self.cube.root_body)

    def _setup_observables(self):
        observables = super()._setup_observables()

        @sensor(modality="object")
        def brick_pos(obs_cache):
            return np.array(self.sim.data.body_xpos[self.cube_id])

        prefix = self._get_arm_prefixes(self.robots[0])[0]
        offset = self._get_obj_eef_sensor(prefix, "brick_pos", "to_brick", "object")
        for made in (brick_pos, offset):
            name = made.__name__
            observables[name] = Observable(
                name=name, sensor=made, sampling_rate=self.control_freq
            )
        return observables

    def _reset_internal(self):
        super()._reset_internal()
        if not self.deterministic_reset:
            for pos, quat, item in self.placement_initializer.sample().values():
                self.sim.data.set_joint_qpos(item.joints[0], [*pos, *quat])

    def _check_success(self):
        return self.sim.data.body_xpos[self.cube_id][0] > 0.1


@pytest.fixture(scope="module")
def push(suite):
    return suite.make(
        "PushCube", robots="Panda", use_camera_obs=False, seed=3, reward_shaping=True
    )


@pytest.mark.slow
def test_an_environment_of_a_user_runs(push):
    seen = push.reset()
    assert seen["object-state"].shape == (6,)
    assert seen["brick_pos"][2] > 0.82
    for _ in range(10):
        seen, reward, done, _ = push.step(np.zeros(push.action_dim))
    half = push.cube.size[2]
    assert seen["brick_pos"][2] == pytest.approx(0.8 + half, abs=2e-3)
    hand = push.sim.data.get_site_xpos("gripper0_right_grip_site")
    np.testing.assert_allclose(seen["to_brick"], seen["brick_pos"] - hand, atol=1e-9)
    distance = np.linalg.norm(seen["to_brick"])
    assert reward == pytest.approx(1.0 - np.tanh(10.0 * distance))
    assert not done
    assert push.check_contact(push.cube, "table")
    assert push.get_contacts(push.cube) == {"table_collision"}
    push.sim.data.set_joint_qpos(push.cube.joints[0], [0.2, 0, 0.83, 1, 0, 0, 0])
    push.sim.forward()
    assert push._check_success()
    assert push.reward() == 1.0


@pytest.mark.slow
def test_hard_reset_draws_sizes_again_and_a_seed_repeats_them(suite, push):
    push.reset()  # the first one keeps the scene
    sizes, loads = [], push.loads
    for _ in range(2):
        push.reset()
        sizes.append(tuple(push.cube.size))
        geom = push.sim.model.geom_name2id("brick_g0")
        np.testing.assert_allclose(push.sim.model.geom_size[geom], push.cube.size)
    assert sizes[0] != sizes[1]
    assert push.loads == loads + 2
    first = [
        suite.make("PushCube", robots="Panda", use_camera_obs=False, seed=7).reset()
        for _ in range(2)
    ]
    np.testing.assert_array_equal(first[0]["brick_pos"], first[1]["brick_pos"])


@pytest.mark.slow
def test_states_replay_in_the_scene_of_their_text(push):
    push.reset()
    for _ in range(3):
        push.step(np.zeros(7))
    text, state = push.sim.model.get_xml(), push.sim.get_state().flatten()
    size = np.array(push.cube.size)
    model = push.sim.model
    geom = model.geom_name2id("brick_g0")
    model._model.geom_size[geom] = 0.05
    push.reset_from_xml_string(text)
    np.testing.assert_allclose(model.geom_size[geom], size, atol=1e-6)
    push.sim.set_state_from_flattened(state)
    push.sim.forward()
    np.testing.assert_array_equal(push.sim.get_state().flatten(), state)


class ShinyLift(Lift):
    """Our task with another reward."""

    def reward(self, action=None):
        return 7.0 + super().reward(action)


def test_a_task_of_ours_is_a_base_class(suite):
    env = suite.make("ShinyLift", robots="Panda", use_camera_obs=False)
    env.reset()
    assert env.step(np.zeros(7))[1] == 7.0
    assert isinstance(env, ManipulationEnv)
    assert env.name == "ShinyLift"


class Shelf(TwoArmEnv):
    """A room of a user's file with a bottle of another, for two arms."""

    files = ("", "")

    def reward(self, action=None):
        return 0.0

    def _load_model(self):
        super()._load_model()
        room, bottle = self.files
        for k, robot in enumerate(self.robots):
            robot.robot_model.set_base_xpos([-0.7, 0.5 - k, 0.0])
        self.bottle = MujocoXMLObject(str(bottle), name="bottle")
        self.model = ManipulationTask(
            Arena(str(room)), [r.robot_model for r in self.robots], [self.bottle]
        )


@pytest.mark.slow
def test_files_of_users_make_a_scene(suite, tmp_path):
    for name, text in (("room.xml", ROOM), ("bottle.xml", BOTTLE)):
        (tmp_path / name).write_text(text)
    Shelf.files = tmp_path / "room.xml", tmp_path / "bottle.xml"
    env = suite.make("Shelf", robots=["Panda", "UR5e"], use_camera_obs=False)
    env.reset()
    env.sim.data.set_joint_qpos("bottle_joint0", [0.2, 0, 0.81, 1, 0, 0, 0])
    for _ in range(10):
        env.step(np.zeros(env.action_dim))
    height = env.sim.data.get_body_xpos("bottle_main")[2]
    assert height == pytest.approx(0.8, abs=3e-3)  # it stands on the shelf
    assert env.check_contact(env.bottle, "shelf")
    assert env.sim.model.site_name2id("bottle_grip") >= 0
    apart = env._eef0_xpos - env._eef1_xpos
    assert apart[1] > 0.5
    assert env.bottle.top_offset[2] == 0.152
    assert env.bottle.horizontal_radius == pytest.approx(0.03)


def test_a_class_without_a_scene_says_so(suite):
    class NoScene(ManipulationEnv):
        """It sets no model."""

    with pytest.raises(ConfigError, match=r"NoScene\._load_model"):
        suite.make("NoScene", robots="Panda", use_camera_obs=False)


class Cross(MujocoGeneratedObject):
    """Two bars."""

    def __init__(self, name, length):
        super().__init__()
        self._name, self.length = name, length
        self._get_object_properties()

    def _get_object_subtree(self):
        body = new_body(name="cross")
        for k in range(2):
            size = [0.01, 0.01, 0.01]
            size[k] = self.length / 2
            body.append(new_geom(f"bar{k}", "box", size, density=500))
        return body


def test_generated_objects_have_robosuites_names():
    cross = Cross("cross", 0.2)
    assert cross.root_body == "cross_main"
    assert cross.joints == ["cross_joint0"]
    assert cross.contact_geoms == ["cross_bar0", "cross_bar1"]
    assert cross.important_sites == {"obj": "cross_default_site"}
    assert cross.naming_prefix == "cross_"
    assert cross.visual_geoms == []


@pytest.mark.parametrize(
    ("cls", "size", "radius", "half"),
    [
        (BoxObject, [0.03, 0.04, 0.05], 0.05, 0.05),
        (BallObject, [0.03], 0.03, 0.03),
        (CylinderObject, [0.03, 0.06], 0.03, 0.06),
        (CapsuleObject, [0.03, 0.06], 0.03, 0.09),
    ],
)
def test_shapes_know_their_extent(cls, size, radius, half):
    item = cls(name="thing", size=size)
    assert item.horizontal_radius == pytest.approx(radius)
    assert item.top_offset[2] == pytest.approx(half)
    assert item.bottom_offset[2] == pytest.approx(-half)
    with pytest.raises(ConfigError, match="positive sizes"):
        cls(name="thing", size=[0.0] * len(size))


class Wand(Device):
    """A device that always moves up."""

    def start_control(self):
        self._reset_internal_state()

    def get_controller_state(self):
        return {
            "dpos": np.array([0.0, 0.0, 0.02]),
            "rotation": np.eye(3),
            "raw_drotation": np.zeros(3),
            "grasp": 1,
            "reset": 0,
            "base_mode": 0,
        }


@pytest.mark.slow
def test_a_device_of_a_user_drives_the_active_arm(suite):
    env = suite.make("Lift", robots="Panda", use_camera_obs=False)
    env.reset()
    device = Wand(env)
    device.start_control()
    start = env._eef_xpos[2]
    for _ in range(10):
        given = device.input2action()
        robot = env.robots[device.active_robot]
        action = robot.create_action_vector(
            {"right": given["right_delta"], "right_gripper": given["right_gripper"]}
        )
        env.step(action)
    assert env._eef_xpos[2] > start + 0.03
    assert device.grasp
    assert env._get_observations()["robot0_gripper_qpos"][0] < 0.03
    with pytest.raises(ConfigError, match="goal_update_mode"):
        device.get_arm_action(robot, "right", np.zeros(6), "sideways")


def test_a_robot_is_composed_of_parts(suite):
    create_composite_robot("MyArm", "Sawyer", base="NullMount", grippers="PandaGripper")
    assert ROBOT_CLASS_MAPPING["MyArm"].__name__ == "FixedBaseRobot"
    env = suite.make("Lift", robots="MyArm", use_camera_obs=False)
    seen = env.reset()
    assert seen["robot0_gripper_qpos"].shape == (2,)
    assert env.robots[0].robot_model.name == "MyArm0"
    with pytest.raises(UnknownNameError, match="Did you mean 'Sawyer'"):
        create_composite_robot("Other", "Sawyerr")


@pytest.mark.parametrize("name", ["G1ThreeFingerLeftGripper", "InspireLeftHand"])
def test_a_hand_of_the_other_side_is_replaced_by_its_mirror_image(name, caplog):
    create_composite_robot("OneHanded", "Panda", base="NullMount", grippers=name)
    own = ROBOT_CLASS_MAPPING["OneHanded"]("OneHanded").robot_model.description
    mirrored = load_robot("Panda", gripper=name.replace("Left", "Right"))
    assert own.synergies == mirrored.synergies
    assert f"'{name}' is of the other side" in caplog.text


@pytest.mark.slow
def test_a_composite_controller_of_a_user_commands_the_arm(suite):
    @register_composite_controller
    class Floppy(CompositeController):
        """It lets the arm fall; the gripper keeps its command."""

        name = "FLOPPY"

        def run_controller(self, enabled_parts=None):
            commands = super().run_controller(enabled_parts)
            commands["right"] = np.zeros_like(commands["right"])
            return commands

    config = suite.load_composite_controller_config(controller="BASIC")
    config["type"] = "FLOPPY"
    env = suite.make(
        "Lift", robots="Panda", controller_configs=config, use_camera_obs=False
    )
    env.reset()
    start = env._eef_xpos[2]
    for _ in range(10):
        env.step(np.zeros(7))
    assert env._eef_xpos[2] < start - 0.05
    assert isinstance(env.robots[0].composite_controller, Floppy)
