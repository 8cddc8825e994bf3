"""One robot of an environment: its model, its parts, its measured state."""

from collections.abc import Callable, Mapping
from typing import Any

import mujoco
import numpy as np

from wbc_suite.compat.robosuite.controllers.user_controllers import (
    CompositeController,
    view_of,
)
from wbc_suite.compat.robosuite.forwarding import does_nothing, forwarded
from wbc_suite.compat.robosuite.models.grippers import (
    GRIPPER_MAPPING,
    GripperModel,
    NullGripper,
)
from wbc_suite.compat.robosuite.models.own_files import changed
from wbc_suite.compat.robosuite.models.robots import create_robot
from wbc_suite.compat.robosuite.utils import ROBOSUITE_DEFAULT_LOGGER
from wbc_suite.compat.robosuite.utils.binding_utils import MjSim
from wbc_suite.compat.robosuite.utils.transform_utils import mat2quat
from wbc_suite.control import RobotState
from wbc_suite.control.robot_parts import parts_of
from wbc_suite.sensing.hands import hands_of
from wbc_suite.typing import Array, Indices, Vector


def _by_arm(source: str, part: Callable[[Array], Array]) -> Any:
    """Return a property: a part of the value of each arm that another one has."""
    return property(
        lambda self: {arm: part(x) for arm, x in getattr(self, source).items()}
    )


class Robot:
    """A robot by the name of its model's class.

    Before the scene exists there are only its models; `bind` gives it its state.
    Values by arm are dictionaries with the keys `right`, `left`.

    Attributes:
        robot_model: See `RobotModel`.
        gripper: The gripper of each arm.
        composite_controller: See `CompositeController`.
        eef_site_id: Site between the fingers, by arm.
    """

    def __init__(
        self,
        robot_type: str,
        idn: int = 0,
        composite_controller_config: Any = None,
        initial_qpos: Any = None,
        initialization_noise: Any = None,
        base_type: Any = "default",
        gripper_type: Any = "default",
        control_freq: float = 20,
        lite_physics: bool = True,
    ) -> None:
        self.name, self.idn = robot_type, idn
        self.composite_controller_config = composite_controller_config
        self.initial_qpos = initial_qpos
        self.control_freq, self.lite_physics = control_freq, lite_physics
        self.robot_model: Any = create_robot(robot_type, idn=idn)
        self.gripper_type, self.base_type = gripper_type, base_type
        base = None if base_type == "default" else base_type
        gripper_type = "none" if gripper_type is None else gripper_type
        self.robot_model.load(gripper_type, base)
        if initial_qpos is not None:
            self._start_at(initial_qpos)
        self.gripper: dict[str, GripperModel] = {}
        self.disabled: set[str] = set()
        self._adopt_grippers()

    def _start_at(self, qpos: Any) -> None:
        """Write the joints' positions at the start into the description."""
        robot = self.robot_model.description
        given = dict(zip(self._joints(), qpos, strict=True))
        ready = {"ready": robot.keyframes["ready"] | given}
        keyframes = {**robot.keyframes, **ready}
        self.robot_model.description = changed(robot, keyframes=keyframes)

    def _adopt_grippers(self) -> None:
        robot, prefix = self.robot_model.description, self.robot_model.naming_prefix
        self.arms = tuple(robot.hands)
        for arm in self.arms:
            has_one = f"{arm}_gripper" in robot.synergies
            given = self.gripper_type
            given = given.get(arm) if isinstance(given, Mapping) else given
            if given == "default":
                given = self.robot_model.default_gripper.get(arm)
            cls = GRIPPER_MAPPING.get(given, GripperModel) if has_one else NullGripper
            self.gripper[arm] = _mounted(cls, robot, prefix, arm, f"{self.idn}_{arm}")

    def bind(self, sim: MjSim, state: RobotState, controller: Any) -> None:
        """Take the robot's place in a simulation."""
        self.sim, self._state = sim, state
        self.robot_model.description = state.robot
        self._adopt_grippers()
        self.init_qpos = self.robot_model.init_qpos
        models = sim, self.robot_model, self.gripper
        self.composite_controller: CompositeController = view_of(
            controller, state, models
        )
        self.composite_controller.set_period(1.0 / self.control_freq)
        hands = {hand.name: hand for hand in hands_of(state)}
        self.eef_site_id = {arm: hands[arm].site for arm in self.arms}
        names = self._joints()
        q, v = state.joint_addresses(names)
        self._ref_joint_pos_indexes: Indices = q
        self._ref_joint_vel_indexes: Indices = v
        ids = [state.model.joint(state.prefix + n).id for n in names]
        self._ref_joint_indexes: Indices = np.array(ids)
        self._ref_gripper_joint_pos_indexes, self._ref_gripper_joint_vel_indexes = (
            {arm: [find(j) for j in g.own_joints] for arm, g in self.gripper.items()}
            for find in (sim.model.get_joint_qpos_addr, sim.model.get_joint_qvel_addr)
        )

    def _joints(self) -> tuple[str, ...]:
        """Return our names of its joints, without the robot's number."""
        robot, prefix = self.robot_model, len(self.robot_model.naming_prefix)
        return tuple(name[prefix:] for name in robot.own_joints)

    def __getattr__(self, name: str) -> Any:
        if name in ("robot_model", "_state") or name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.robot_model.description, name)

    dof = forwarded("robot_model", "dof", "Number of its joints, without grippers.")
    robot_joints = forwarded(
        "robot_model", "joints", "Names of its joints, without grippers."
    )
    part_controllers = forwarded(
        "composite_controller", "part_controllers", "Controllers of its parts, by name."
    )
    action_limits = forwarded(
        "composite_controller", "action_limits", "Least and greatest actions."
    )
    _action_split_indexes = forwarded(
        "composite_controller", "_action_split_indexes", "Begin and end of each part."
    )
    create_action_vector = forwarded(
        "composite_controller",
        "create_action_vector",
        "An action from values of parts, and zeros for the others.",
    )
    load_model = does_nothing("its models are loaded when it is made")
    reset = does_nothing("the environment resets its robots")
    visualize = does_nothing("robots have no visual marks")

    # What the robot is made of.

    @property
    def is_mobile(self) -> bool:
        """Whether its base moves."""
        return self.robot_model.description.root.kind != "fixed"

    @property
    def has_gripper(self) -> dict[str, bool]:
        """Whether each arm has a gripper."""
        return {arm: g.dof > 0 for arm, g in self.gripper.items()}

    @property
    def gripper_joints(self) -> dict[str, list[str]]:
        """Names of the gripper's joints, by arm."""
        return {arm: gripper.joints for arm, gripper in self.gripper.items()}

    @property
    def joint_indexes(self) -> list[int]:
        """Indices of its joints in the scene, without grippers."""
        return self._ref_joint_indexes.tolist()

    @property
    def part_controller_config(self) -> dict[str, Any]:
        """Configs of the parts that it has, by name, those of grippers included."""
        config, found = self.composite_controller_config, {}
        given = config.get("body_parts", {}) if isinstance(config, Mapping) else {}
        for part in self.part_controllers:
            arm = part.removesuffix("_gripper")
            own = given.get(arm, {})
            found[part] = own if part == arm else own.get("gripper", {})
        return found

    def has_part(self, part_name: str) -> bool:
        """Whether it has a part, such as `torso`."""
        return part_name in parts_of(self.robot_model.description)

    def get_gripper_name(self, arm: str) -> str:
        """Return the name of an arm's gripper in the action."""
        return f"{arm}_gripper"

    def enabled(self, part_name: str) -> bool:
        """Whether a part is driven."""
        return part_name in self.part_controllers and part_name not in self.disabled

    # Measured state; values by arm are dictionaries.

    @property
    def _joint_positions(self) -> Vector:
        return self.sim.data._data.qpos[self._ref_joint_pos_indexes]

    @property
    def _joint_velocities(self) -> Vector:
        return self.sim.data._data.qvel[self._ref_joint_vel_indexes]

    @property
    def torques(self) -> Vector:
        """Torques that its actuators exert, N m."""
        return self.sim.data._data.qfrc_actuator[self._ref_joint_vel_indexes].copy()

    @property
    def js_energy(self) -> Vector:
        """Absolute torques of its actuators times a control period."""
        force = self.sim.data._data.qfrc_actuator[self._ref_joint_vel_indexes]
        return np.abs(force) / self.control_freq

    @property
    def _hand_pose(self) -> dict[str, Array]:
        """Pose of the last body of each arm in the base's frame, shape (4, 4)."""
        names = self.robot_model.eef_name
        return {arm: self.pose_in_base_from_name(n) for arm, n in names.items()}

    _hand_pos = _by_arm("_hand_pose", lambda pose: pose[:3, 3])
    _hand_orn = _by_arm("_hand_pose", lambda pose: pose[:3, :3])
    _hand_quat = _by_arm("_hand_pose", mat2quat)
    _hand_vel = _by_arm("_hand_total_velocity", lambda twist: twist[:3])
    _hand_ang_vel = _by_arm("_hand_total_velocity", lambda twist: twist[3:])

    @property
    def _hand_total_velocity(self) -> dict[str, Vector]:
        """Linear and angular velocity of that body, in the base's axes, shape (6,)."""
        model, data, R = self._state.model, self.sim.data._data, self.base_ori
        found: dict[str, Vector] = {}
        for arm, name in self.robot_model.eef_name.items():
            twist = np.zeros(6)
            body = self.sim.model.index("body", name)
            kind = mujoco.mjtObj.mjOBJ_BODY
            mujoco.mj_objectVelocity(model, data, kind, body, twist, 0)
            found[arm] = np.concatenate([R.T @ twist[3:], R.T @ twist[:3]])
        return found

    ee_force = property(lambda self: self._wrench("force_ee"), doc="At each wrist, N.")
    ee_torque = property(
        lambda self: self._wrench("torque_ee"), doc="At each wrist, N m."
    )

    def _wrench(self, kind: str) -> dict[str, Vector]:
        return {
            arm: self.get_sensor_measurement(gripper.important_sensors[kind])
            for arm, gripper in self.gripper.items()
        }

    def get_sensor_measurement(self, sensor_name: str) -> Vector:
        """Return the values of a sensor."""
        model = self.sim.model
        sensor = model.index("sensor", sensor_name)
        first = model.sensor_adr[sensor]
        data = self.sim.data._data.sensordata
        return data[first : first + model.sensor_dim[sensor]].copy()

    @property
    def base_pos(self) -> Vector:
        """Position of its base in the world, m."""
        return self.sim.data.get_body_xpos(self.robot_model.root_body)

    @property
    def base_ori(self) -> Array:
        """Orientation of its base in the world, shape (3, 3)."""
        return self.sim.data.get_body_xmat(self.robot_model.root_body)

    def pose_in_base_from_name(self, name: str) -> Array:
        """Return the pose of a body in the base's frame, shape (4, 4)."""
        data, pose = self.sim.data, np.eye(4)
        R = self.base_ori
        pose[:3, :3] = R.T @ data.get_body_xmat(name)
        pose[:3, 3] = R.T @ (data.get_body_xpos(name) - self.base_pos)
        return pose

    def check_q_limits(self) -> bool:
        """Whether a joint is within 0.1 rad of the end of its range."""
        ranges = self._state.model.jnt_range[self._ref_joint_indexes]
        limited = self._state.model.jnt_limited[self._ref_joint_indexes].astype(bool)
        q, (low, high) = self._joint_positions, ranges.T
        return bool((limited & ((q < low + 0.1) | (q > high - 0.1))).any())

    # Actions.

    @property
    def action_dim(self) -> int:
        """Number of its action values."""
        return self.composite_controller.layout.size

    def print_action_info(self) -> None:
        """Log the splits of the action."""
        _log(self.composite_controller.get_action_info())

    def print_action_info_dict(self) -> None:
        """Log dimension and indices of the action by part."""
        _log(self.composite_controller.get_action_info_dict())

    @property
    def torque_limits(self) -> tuple[Vector, Vector]:
        """Least and greatest torques of its joints' actuators, N m or N."""
        model, names = self._state.model, self.robot_model.own_joints
        known = {model.actuator(i).name: i for i in range(model.nu)}
        ids = [known[name] for name in names if name in known]
        low, high = model.actuator_ctrlrange[ids].T
        return low.copy(), high.copy()

    # Written state.

    def set_robot_joint_positions(self, jpos: Any) -> None:
        """Write the positions of its joints, without grippers."""
        self.sim.data._data.qpos[self._ref_joint_pos_indexes] = jpos
        self.sim.forward()

    def set_gripper_joint_positions(
        self, jpos: Any, gripper_arm: str | None = None
    ) -> None:
        """Write the positions of a gripper's joints."""
        arm = self.arms[0] if gripper_arm is None else gripper_arm
        self.sim.data._data.qpos[self._ref_gripper_joint_pos_indexes[arm]] = jpos
        self.sim.forward()

    def get_robot_joint_positions(self) -> Vector:
        """Return the positions of its joints, without grippers."""
        return self._joint_positions.copy()

    def get_gripper_joint_positions(self, gripper_arm: str | None = None) -> Vector:
        """Return the positions of a gripper's joints."""
        arm = self.arms[0] if gripper_arm is None else gripper_arm
        return self.sim.data._data.qpos[self._ref_gripper_joint_pos_indexes[arm]]


def _mounted(
    cls: type[GripperModel], robot: Any, prefix: str, arm: str, idn: str
) -> GripperModel:
    """Return the model of the gripper on an arm."""
    gripper = object.__new__(cls)
    GripperModel.__init__(gripper, None, idn, robot=robot, prefix=prefix, arm=arm)
    if not cls.__module__.startswith("wbc_suite."):
        gripper.own_file = cls().own_file
    return gripper


def models_of(state: RobotState) -> tuple[MjSim, Any, dict[str, GripperModel]]:
    """Return simulation, robot model and grippers of a robot in a scene."""
    index = int(state.prefix.removeprefix("robot").removesuffix("_") or 0)
    model = create_robot("Panda", idn=index)
    model.description = state.robot
    grippers = {
        arm: _mounted(GripperModel, state.robot, state.prefix, arm, f"{index}_{arm}")
        for arm in state.robot.hands
    }
    return MjSim(state.model, state.data), model, grippers


def _log(table: Mapping[str, Any]) -> None:
    for name, value in table.items():
        ROBOSUITE_DEFAULT_LOGGER.info("%s: %s", name, value)
