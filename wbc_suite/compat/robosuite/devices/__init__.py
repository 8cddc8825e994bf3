"""Devices with robosuite's interface, and the actions that their states become."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.utils.transform_utils import mat2quat, quat2axisangle
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

STEP_TO_ACTION = 20.0
"""Action of a step of 1 m or rad of a device in one control period, before clipping."""


class Device(ABC):
    """An input device that moves the active arm of the active robot.

    A subclass returns from `get_controller_state` the keys `dpos` (m), `raw_drotation`
    (roll, pitch, yaw of the step, rad), `rotation` (matrix), `grasp` (0 or 1), `reset`
    (0 or 1) and `base_mode`.
    """

    def __init__(self, env: Any) -> None:
        self.env = env
        self.all_robot_arms = [robot.arms for robot in env.robots]
        self.num_robots = len(env.robots)
        self._reset_internal_state()

    def _reset_internal_state(self) -> None:
        """Open all grippers, and make the first arm of the first robot active."""
        self.grasp_states = [[False] * len(arms) for arms in self.all_robot_arms]
        self.active_arm_indices = [0] * self.num_robots
        self.active_robot = 0
        self.base_modes = [False] * self.num_robots

    @property
    def active_arm(self) -> str:
        """Name of the active arm."""
        return self.all_robot_arms[self.active_robot][self.active_arm_index]

    @property
    def active_arm_index(self) -> int:
        """Index of the active robot's active arm."""
        return self.active_arm_indices[self.active_robot]

    @active_arm_index.setter
    def active_arm_index(self, value: int) -> None:
        self.active_arm_indices[self.active_robot] = value

    @property
    def grasp(self) -> bool:
        """Whether the active gripper is to close."""
        return self.grasp_states[self.active_robot][self.active_arm_index]

    @property
    def base_mode(self) -> bool:
        """Whether the device drives the base instead of an arm."""
        return self.base_modes[self.active_robot]

    @abstractmethod
    def start_control(self) -> None:
        """Get ready to be read."""

    @abstractmethod
    def get_controller_state(self) -> dict[str, Any]:
        """Return what the device says now."""

    def _postprocess_device_outputs(
        self, dpos: Any, drotation: Any
    ) -> tuple[Vector, Vector]:
        """Return steps as values of an action, -1 to 1."""
        dpos = np.clip(np.asarray(dpos, np.float64) * STEP_TO_ACTION, -1.0, 1.0)
        turn = np.clip(np.asarray(drotation, np.float64), -1.0, 1.0)
        return dpos, turn

    def input2action(
        self, mirror_actions: bool = False, goal_update_mode: str = "target"
    ) -> dict[str, Any] | None:
        """Return the action of each part of the active robot; None asks for a reset.

        Keys: `{arm}_delta` and `{arm}_abs` with 6 values, `{arm}_gripper`, and `base`,
        `torso`, `base_mode` where the robot has them.
        """
        state = self.get_controller_state()
        if state["reset"]:
            return None
        robot, arm = self.env.robots[self.active_robot], self.active_arm
        dpos, turn = np.array(state["dpos"]), np.array(state["raw_drotation"])
        if mirror_actions:
            dpos[:2], turn[:2] = -dpos[:2], -turn[:2]
        turn = turn[[1, 0, 2]] * (1.0, 1.0, -1.0)
        dpos, turn = self._postprocess_device_outputs(dpos, turn)
        self.grasp_states[self.active_robot][self.active_arm_index] = state["grasp"]
        action: dict[str, Any] = {}
        for k, name in enumerate(robot.arms):
            zero = np.zeros(6)
            action |= self.get_arm_action(robot, name, zero, goal_update_mode)
            closed = self.grasp_states[self.active_robot][k]
            action[f"{name}_gripper"] = np.full(
                robot.gripper[name].dof, 1.0 if closed else -1.0
            )
        drives_base = bool(state.get("base_mode")) and robot.is_mobile
        if drives_base:
            action["base"] = np.array([dpos[0], dpos[1], turn[2]])
        else:
            delta = np.concatenate([dpos, turn])
            action |= self.get_arm_action(robot, arm, delta, goal_update_mode)
        if robot.is_mobile:
            action["base_mode"] = np.array([1.0 if drives_base else -1.0])
            action.setdefault("base", np.zeros(3))
            if robot.has_part("torso"):
                action["torso"] = self.get_torso_action(robot, np.zeros(1))
        return action

    def get_arm_action(
        self, robot: Any, arm: str, norm_delta: Any, goal_update_mode: str = "target"
    ) -> dict[str, Vector]:
        """Return the step of an arm, and the pose that it leads to.

        Raises:
            ConfigError: If the mode is neither `target` nor `achieved`.
        """
        if goal_update_mode not in ("target", "achieved"):
            raise ConfigError("goal_update_mode is 'target' or 'achieved'.")
        controller = robot.part_controllers[arm]
        position, R = robot._hand_pos[arm], robot._hand_orn[arm]
        if goal_update_mode == "target" and controller.goal_pos is not None:
            position, R = controller.goal_pos, controller.goal_ori
        turn = quat2axisangle(mat2quat(R))
        pose = np.concatenate([position + 0.05 * np.asarray(norm_delta)[:3], turn])
        return {f"{arm}_delta": np.asarray(norm_delta, float), f"{arm}_abs": pose}

    def get_torso_action(self, robot: Any, device_input: Any) -> Vector:
        """Return the action of the torso: none."""
        low, _ = robot.part_controllers["torso"].control_limits
        return np.zeros(len(low))


class _Ours(Device):
    """One of our devices: `wbc_suite.devices`, whose pages and pipelines stay there."""

    def __init__(
        self,
        env: Any,
        pos_sensitivity: float = 1.0,
        rot_sensitivity: float = 1.0,
    ) -> None:
        super().__init__(env)
        self.pos_sensitivity = pos_sensitivity
        self.rot_sensitivity = rot_sensitivity

    def _reset_internal_state(self) -> None:
        super()._reset_internal_state()
        self._step, self._turn = np.zeros(3), np.zeros(3)
        self._closed = self._reset = False

    def start_control(self) -> None:
        """Open all grippers, and forget what was pressed."""
        self._reset_internal_state()

    def get_controller_state(self) -> dict[str, Any]:
        """Return the steps since the last call."""
        step, turn = self._step.copy(), self._turn.copy()
        reset, self._reset = self._reset, False
        self._step[:], self._turn[:] = 0.0, 0.0
        return {
            "dpos": step * self.pos_sensitivity,
            "rotation": np.eye(3),
            "raw_drotation": turn * self.rot_sensitivity,
            "grasp": int(self._closed),
            "reset": int(reset),
            "base_mode": int(self.base_mode),
        }


class Keyboard(_Ours):
    """Keys of robosuite, handed over by `on_press` of whatever window has the focus.

    Arrows move in the plane, `.` and `;` up and down, `o p y h e r` turn, the space
    bar moves the gripper, `q` resets, `b` drives the base, `s` and `=` change arm and
    robot.
    """

    MOVES = {"up": (0, -1), "down": (0, 1), "left": (1, -1), "right": (1, 1)} | {
        ".": (2, -1),
        ";": (2, 1),
    }
    TURNS = {"o": (0, -1), "p": (0, 1), "y": (1, 1), "h": (1, -1)} | {
        "e": (2, 1),
        "r": (2, -1),
    }

    def on_press(self, key: Any) -> None:
        """Take a pressed or repeated key: its name, or an object with `char`."""
        name = getattr(key, "char", None) or getattr(key, "name", None) or str(key)
        if name in self.MOVES:
            axis, sign = self.MOVES[name]
            self._step[axis] += sign * 0.05
        elif name in self.TURNS:
            axis, sign = self.TURNS[name]
            self._turn[axis] += sign * 0.1

    def on_release(self, key: Any) -> None:
        """Take a key that is released."""
        name = getattr(key, "char", None) or getattr(key, "name", None) or str(key)
        if name == "space":
            self._closed = not self._closed
        elif name == "q":
            self._reset = True
        elif name == "b":
            self.base_modes[self.active_robot] = not self.base_mode
        elif name == "s":
            count = len(self.all_robot_arms[self.active_robot])
            self.active_arm_index = (self.active_arm_index + 1) % count
        elif name == "=":
            self.active_robot = (self.active_robot + 1) % self.num_robots


class SpaceMouse(_Ours):
    """A SpaceMouse, read by our device when control starts."""

    def start_control(self) -> None:
        """Open the device; see `wbc_suite.devices.spacemouse` for errors."""
        from wbc_suite.devices.spacemouse import SpaceMouse as Reader

        super().start_control()
        self._reader = Reader()
