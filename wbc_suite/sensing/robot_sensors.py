"""What a robot's own sensors say: forces, torques, motions of the trunk, touch."""

import mujoco
import numpy as np

from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.sensing.hands import gripper_links
from wbc_suite.sensing.reading import (
    Reading,
    actuator_forces,
    computed,
    sensor_values,
)

__all__ = ["add_contact_sensors", "sensors_of"]

FOUND, FORCE = (
    mujoco.mjtConDataField.mjCONDATA_FOUND,
    mujoco.mjtConDataField.mjCONDATA_FORCE,
)
NET_FORCE = 3
"""MuJoCo's way to reduce contacts: their sum, in the world's axes."""


def add_contact_sensors(
    spec: mujoco.MjSpec, robot: RobotDescription, prefix: str
) -> None:
    """Let MuJoCo sum what touches each foot, and each link of the grippers."""
    links = {f"{frame}_contact": link for frame, link in _feet(robot).items()}
    for side in robot.hands:
        links |= {f"{side}_touch_{link}": link for link in _touching(robot, side)}
    for name, link in links.items():
        spec.add_sensor(
            name=prefix + name,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            objname=prefix + link,
            intprm=[1 << int(FOUND) | 1 << int(FORCE), NET_FORCE, 1],
        )


def sensors_of(state: RobotState) -> dict[str, Reading]:
    """Return the readings of one robot's sensors.

    `joint_torque` holds what the motors exert at all joints but the grippers', the
    sensors of the description have their own names (force N, torque N m, gyro rad/s,
    accelerometer m/s^2 with gravity, touch N; in their frames' axes). Each foot has
    `_contact`, 1 on the ground and 0 in the air, and `_contact_force`, what acts on it
    in the world, N. Each hand has `_touch`: how strongly each link of its gripper that
    can touch is pressed on, N, in the robot's order. MuJoCo computes sensors during a
    step, so they are one physics step behind positions unless `lite_physics=False`.
    """
    robot, model = state.robot, state.model
    _, v = state.joint_addresses(tuple(_moved(robot)))
    readings = {"joint_torque": actuator_forces(v)}
    for sensor in robot.sensors:
        first, size = _place(model, state.prefix + sensor.name)
        readings[sensor.name] = sensor_values(range(first, first + size))
    for frame in _feet(robot):
        first, _ = _place(model, f"{state.prefix}{frame}_contact")
        readings[f"{frame}_contact"] = _found(state.data, first)
        # MuJoCo sums what the foot does to the ground.
        readings[f"{frame}_contact_force"] = sensor_values(
            range(first + 1, first + 4), negated=True
        )
    for side in robot.hands:
        links = _touching(robot, side)
        names = [f"{state.prefix}{side}_touch_{link}" for link in links]
        if names:
            firsts = [_place(model, name)[0] for name in names]
            readings[f"{side}_touch"] = _pressed(state.data, firsts)
    return {state.prefix + key: reading for key, reading in readings.items()}


def _feet(robot: RobotDescription) -> dict[str, str]:
    """Return the link of each foot by its frame."""
    return {f.name: f.link for f in robot.frames if f.role == "foot"}


def _touching(robot: RobotDescription, side: str) -> list[str]:
    """Return the links of a gripper that can touch, in the robot's order."""
    links = gripper_links(robot, side, robot.hands[side])
    return [k.name for k in robot.links if k.name in links and k.collision]


def _found(data: mujoco.MjData, first: int) -> Reading:
    """Read whether a contact sensor found any."""
    count = data.sensordata[first : first + 1]
    return computed(1, lambda: count > 0.0)


def _pressed(data: mujoco.MjData, firsts: list[int]) -> Reading:
    """Read the sizes of contact sensors' forces, N."""
    places = np.add.outer(firsts, np.arange(1, 4))
    return computed(
        len(firsts), lambda: np.linalg.norm(data.sensordata[places], axis=1)
    )


def _moved(robot: RobotDescription) -> list[str]:
    fingers = {
        joint
        for name, joints in robot.groups.items()
        if name.endswith("gripper")
        for joint in joints
    }
    return [
        joint.name
        for joint in robot.joints
        if joint.name not in fingers and joint.mimic is None
    ]


def _place(model: mujoco.MjModel, name: str) -> tuple[int, int]:
    sensor = model.sensor(name)
    return int(sensor.adr[0]), int(sensor.dim[0])
