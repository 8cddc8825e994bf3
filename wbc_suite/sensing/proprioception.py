"""What a robot feels of itself, under the keys that this field's datasets use."""

import numpy as np

from wbc_suite.control import RobotState
from wbc_suite.sensing.hands import hands_of
from wbc_suite.typing import Vector

__all__ = ["Proprioception"]


class Proprioception:
    """Joint, base, hand and gripper readings of one robot.

    Keys begin with the robot's prefix. Joints are all but those of grippers, in the
    robot's order; with several hands their keys begin with `right_` and `left_`.
    Quaternions are x y z w, as in those datasets. Positions are in the world.

    Args:
        state: The robot in the simulation.
    """

    def __init__(self, state: RobotState) -> None:
        self._state = state
        robot = state.robot
        self.hands = hands_of(state)
        self._grippers = {
            name: state.joint_addresses(joints)
            for name, joints in robot.groups.items()
            if name.endswith("gripper") and joints
        }
        fingers = {
            joint
            for name, joints in robot.groups.items()
            if name.endswith("gripper")
            for joint in joints
        }
        body = tuple(
            joint.name
            for joint in robot.joints
            if joint.name not in fingers and joint.mimic is None
        )
        self._q, self._v = state.joint_addresses(body)

    def observe(self) -> dict[str, Vector]:
        """Return all readings by key; the last one holds all others in order."""
        prefix, data = self._state.prefix, self._state.data
        q, v = data.qpos[self._q], data.qvel[self._v]
        values = {
            "joint_pos": q,
            "joint_pos_cos": np.cos(q),
            "joint_pos_sin": np.sin(q),
            "joint_vel": v,
            **self._base(),
            **self._hand_values(),
            **self._gripper_values(),
        }
        named = {prefix + key: value for key, value in values.items()}
        named[f"{prefix}proprio-state"] = np.concatenate(list(values.values()))
        return named

    def _base(self) -> dict[str, Vector]:
        if self._state.robot.root.kind == "fixed":
            return {}
        pose = self._state.root_pose
        twist = self._state.v[: 6 if self._state.robot.root.kind == "free" else 3]
        body = self._state.data.body(
            self._state.prefix + self._state.robot.links[0].name
        )
        return {
            "base_pos": pose.translation.copy(),
            "base_quat": body.xquat[[1, 2, 3, 0]],
            "base_vel": twist,
        }

    def _hand_values(self) -> dict[str, Vector]:
        several = len(self.hands) > 1
        values: dict[str, Vector] = {}
        for hand in self.hands:
            side = f"{hand.name}_" if several else ""
            values[f"{side}eef_pos"] = hand.position.copy()
            values[f"{side}eef_quat"] = hand.quat_xyzw
        return values

    def _gripper_values(self) -> dict[str, Vector]:
        several = len(self._grippers) > 1
        data = self._state.data
        values: dict[str, Vector] = {}
        for name, (q, v) in self._grippers.items():
            key = name if several else "gripper"
            values[f"{key}_qpos"] = data.qpos[q]
            values[f"{key}_qvel"] = data.qvel[v]
        return values
