"""Parts of a composite controller, as robosuite's scripts see them."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.forwarding import does_nothing
from wbc_suite.control import RobotState
from wbc_suite.typing import Vector


class PartController:
    """One part of a composite controller, as robosuite's scripts see it.

    Attributes:
        name: Type of the controller.
        control_dim: Number of its action values.
        period: Time between two actions, s.
    """

    period = 0.05

    def __init__(self, name: str, part: Any, state: RobotState) -> None:
        self.part_name, self._part, self._state = name, part, state
        self.name = _type_of(part)
        self.control_dim = sum(len(s.labels) for s in part.slices)
        q, v = (at.tolist() for at in state.joint_addresses(part.law.joints))
        self.joint_index = {"joints": v, "qpos": q, "qvel": v}

    def __getattr__(self, name: str) -> Any:
        config = getattr(self.__dict__["_part"], "config", None)
        if name.startswith("__") or not hasattr(config, name):
            raise AttributeError(f"{self.name} has no attribute '{name}'.")
        value = getattr(config, name)
        if name in ("input_max", "input_min", "output_max", "output_min"):
            return np.broadcast_to(value, self.kp.shape).copy()
        return value

    @property
    def control_limits(self) -> tuple[Vector, Vector]:
        """Least and greatest values of its slices of the action."""
        slices = self._part.slices
        low = np.concatenate([np.zeros(0), *(s.low for s in slices)])
        return low, np.concatenate([np.zeros(0), *(s.high for s in slices)])

    @property
    def joint_pos(self) -> Vector:
        """Positions of its joints."""
        return self._state.data.qpos[self.joint_index["qpos"]]

    @property
    def joint_vel(self) -> Vector:
        """Velocities of its joints."""
        return self._state.data.qvel[self.joint_index["qvel"]]

    @property
    def torques(self) -> Vector:
        """Torques that the actuators of its joints exert now, N m or N."""
        return self._state.data.qfrc_actuator[self.joint_index["qvel"]]

    kp = property(lambda self: self._gain("kp"), doc="Present stiffness.")
    kd = property(lambda self: self._gain("kd"), doc="Present damping.")

    def _gain(self, name: str) -> Vector:
        return np.array(self._part.law.record[name]).ravel()

    @property
    def goal_pos(self) -> Vector | None:
        """Goal of the hand, in the axes of the goal, m; None without a hand."""
        return self._hand_goal("translation")

    @property
    def goal_ori(self) -> Any:
        """Goal orientation of the hand as a matrix; None without a hand."""
        return self._hand_goal("rotation")

    def _hand_goal(self, field: str) -> Any:
        goal = self._part.goal
        return None if isinstance(goal, np.ndarray) else np.array(getattr(goal, field))

    @property
    def goal_qpos(self) -> Vector | None:
        """Goal of the joints; None of a hand."""
        goal = self._part.goal
        return goal if isinstance(goal, np.ndarray) else None

    @property
    def ref_pos(self) -> Vector:
        """Position of the hand, m."""
        return self._site("site_xpos")

    @property
    def ref_ori_mat(self) -> Any:
        """Orientation of the hand in the world, shape (3, 3)."""
        return self._site("site_xmat").reshape(3, 3)

    def _site(self, field: str) -> Any:
        state = self._state
        frame = state.robot.hands[self.part_name]
        site = state.model.site(state.prefix + frame).id
        return np.array(getattr(state.data, field)[site])

    def set_goal(self, action: Any) -> None:
        """Take values of its slices of the action."""
        self._part.set_goal(np.asarray(action, np.float64), self.period)

    def reset_goal(self) -> None:
        """Hold the part where it is."""
        self._part.reset(self._state)

    def update_initial_joints(self, initial_joints: Any) -> None:
        """Hold the part where it is; `set_robot_joint_positions` has moved it."""
        self.reset_goal()

    update = does_nothing("values are read when they are asked for")

    @property
    def interpolator(self) -> Any:
        """Whether it interpolates: None where it does not."""
        ramp = getattr(self._part.config, "interpolation", None)
        return None if ramp is None else SimpleNamespace(order=1)


Controller = PartController


def _kind(name: str, doc: str) -> Any:
    """Return the class of robosuite that its scripts look for; it adds nothing."""
    return type(name, (PartController,), {"__module__": __name__, "__doc__": doc})


OperationalSpaceController = _kind(
    "OperationalSpaceController", "OSC_POSE or OSC_POSITION of an arm."
)
InverseKinematicsController = _kind("InverseKinematicsController", "IK_POSE of an arm.")
JointPositionController = _kind("JointPositionController", "JOINT_POSITION of a part.")
JointVelocityController = _kind("JointVelocityController", "JOINT_VELOCITY of a part.")
JointTorqueController = _kind("JointTorqueController", "JOINT_TORQUE of a part.")
SimpleGripController = _kind("SimpleGripController", "GRIP of a gripper.")
MobileBaseJointVelocityController = _kind(
    "MobileBaseJointVelocityController", "JOINT_VELOCITY of a base."
)

_CLASSES = {
    "OSC_POSE": OperationalSpaceController,
    "OSC_POSITION": OperationalSpaceController,
    "IK_POSE": InverseKinematicsController,
    "JOINT_POSITION": JointPositionController,
    "JOINT_VELOCITY": JointVelocityController,
    "JOINT_TORQUE": JointTorqueController,
    "GRIP": SimpleGripController,
}
"""robosuite's classes by type of controller."""


def _type_of(part: Any) -> str:
    kind = getattr(getattr(part, "config", None), "type", "GRIP")
    return kind.removeprefix("UNCOUPLED_").removeprefix("VARIABLE_")


def part_controller(name: str, part: Any, state: RobotState) -> PartController:
    """Return the view of a part, of robosuite's class for its type."""
    kind = _CLASSES.get(_type_of(part), PartController)
    if name == "base" and kind is JointVelocityController:
        kind = MobileBaseJointVelocityController
    return kind(name, part, state)
