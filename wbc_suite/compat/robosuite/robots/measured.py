"""Measured state of a robot: joints, hands, wrists and base."""

from typing import Any

import mujoco
import numpy as np

from wbc_suite.compat.robosuite.utils.transform_utils import mat2quat
from wbc_suite.typing import Array, Indices, Vector


class Measured:
    """What a robot in a simulation measures; values by arm are dictionaries."""

    sim: Any
    robot_model: Any
    _state: Any
    control_freq: float
    eef_site_id: dict[str, int]
    gripper: dict[str, Any]
    _ref_joint_indexes: Indices
    _ref_joint_pos_indexes: Indices
    _ref_joint_vel_indexes: Indices

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

    @property
    def _hand_pos(self) -> dict[str, Vector]:
        return {arm: pose[:3, 3] for arm, pose in self._hand_pose.items()}

    @property
    def _hand_orn(self) -> dict[str, Array]:
        return {arm: pose[:3, :3] for arm, pose in self._hand_pose.items()}

    @property
    def _hand_quat(self) -> dict[str, Vector]:
        return {arm: mat2quat(R) for arm, R in self._hand_orn.items()}

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

    @property
    def _hand_vel(self) -> dict[str, Vector]:
        return {arm: v[:3] for arm, v in self._hand_total_velocity.items()}

    @property
    def _hand_ang_vel(self) -> dict[str, Vector]:
        return {arm: v[3:] for arm, v in self._hand_total_velocity.items()}

    @property
    def ee_force(self) -> dict[str, Vector]:
        """Force at each wrist, N."""
        return self._wrench("force_ee")

    @property
    def ee_torque(self) -> dict[str, Vector]:
        """Torque at each wrist, N m."""
        return self._wrench("torque_ee")

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
