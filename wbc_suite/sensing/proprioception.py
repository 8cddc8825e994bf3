"""Readings of a robot: joints, base, hands, grippers and sensors.

Keys are those of existing datasets.
"""

import mujoco
import numpy as np

from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.sensing import reading
from wbc_suite.sensing.hands import gripper_links, hands_of
from wbc_suite.sensing.reading import Reading

FIELDS = mujoco.mjtConDataField
FOUND_AND_FORCE = 1 << int(FIELDS.mjCONDATA_FOUND) | 1 << int(FIELDS.mjCONDATA_FORCE)
NET_FORCE = 3
"""MuJoCo's reduction of contacts to their sum, in world axes."""


def proprioception(state: RobotState) -> dict[str, Reading]:
    """Return the joint, base, hand and gripper readings of one robot.

    Keys start with the robot's prefix. Joints are all but those of grippers, in the
    robot's order; with several hands their keys start with `right_` and `left_`.
    Quaternions are x y z w, positions are in the world.
    """
    readings = _joints(state) | _base(state) | _hands(state) | _grippers(state)
    return {state.prefix + key: found for key, found in readings.items()}


def _joints(state: RobotState) -> dict[str, Reading]:
    q, v = state.joint_addresses(_body_joints(state.robot))
    return {
        "joint_pos": reading.joint_positions(q),
        "joint_pos_cos": reading.joint_cosines(q),
        "joint_pos_sin": reading.joint_sines(q),
        "joint_vel": reading.joint_velocities(v),
    }


def _base(state: RobotState) -> dict[str, Reading]:
    kind = state.robot.root.kind
    if kind == "fixed":
        return {}
    size = 6 if kind == "free" else 3
    body = state.model.body(state.prefix + state.robot.links[0].name).id
    return {
        "base_pos": reading.body_position(body),
        "base_quat": reading.body_quat(body),
        "base_vel": reading.computed(size, lambda: state.v[:size]),
    }


def _hands(state: RobotState) -> dict[str, Reading]:
    hands = hands_of(state)
    readings: dict[str, Reading] = {}
    for hand in hands:
        side = f"{hand.name}_" if len(hands) > 1 else ""
        readings[f"{side}eef_pos"] = reading.site_position(hand.site)
        readings[f"{side}eef_quat"] = reading.site_quat(hand.site)
    return readings


def _grippers(state: RobotState) -> dict[str, Reading]:
    grippers = gripper_groups(state.robot)
    readings: dict[str, Reading] = {}
    for name, joints in grippers.items():
        key = name if len(grippers) > 1 else "gripper"
        q, v = state.joint_addresses(joints)
        readings[f"{key}_qpos"] = reading.joint_positions(q)
        readings[f"{key}_qvel"] = reading.joint_velocities(v)
    return readings


def gripper_groups(robot: RobotDescription) -> dict[str, tuple[str, ...]]:
    """Return the driven joints of each gripper, by its group's name."""
    return {
        name: tuple(joints)
        for name, joints in robot.groups.items()
        if name.endswith("gripper") and joints
    }


def _body_joints(robot: RobotDescription) -> tuple[str, ...]:
    """Return the independent joints but those of grippers, in the robot's order."""
    fingers = {joint for joints in gripper_groups(robot).values() for joint in joints}
    own = (joint.name for joint in robot.joints if joint.mimic is None)
    return tuple(name for name in own if name not in fingers)


def add_contact_sensors(
    spec: mujoco.MjSpec, robot: RobotDescription, prefix: str
) -> None:
    """Add a sensor of the net contact force of each foot and gripper link."""
    links = {f"{frame}_contact": link for frame, link in _feet(robot).items()}
    for side in robot.hands:
        links |= {f"{side}_touch_{link}": link for link in _touching(robot, side)}
    for name, link in links.items():
        spec.add_sensor(
            name=prefix + name,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            objname=prefix + link,
            intprm=[FOUND_AND_FORCE, NET_FORCE, 1],
        )


def sensors_of(state: RobotState) -> dict[str, Reading]:
    """Return the readings of one robot's sensors.

    - `joint_torque`: torques of the motors of all joints but the grippers'.
    - The sensors of the description by their names: force N, torque N m, gyro rad/s,
      accelerometer m/s^2 with gravity, touch N; in the axes of their frames.
    - `_contact` of each foot, 1 on the ground and 0 in the air, and `_contact_force`,
      the force on it in the world, N.
    - `_touch` of each hand: contact force of each gripper link with a collision shape,
      N, in the robot's order.

    MuJoCo computes sensors during a step, so they are one physics step behind positions
    unless `lite_physics=False`.
    """
    robot, model = state.robot, state.model
    _, v = state.joint_addresses(_body_joints(robot))
    readings = {"joint_torque": reading.actuator_forces(v)}
    for sensor in robot.sensors:
        places = _places(model, state.prefix + sensor.name)
        readings[sensor.name] = reading.sensor_values(places)
    for frame in _feet(robot):
        found, *force = _places(model, f"{state.prefix}{frame}_contact")
        readings[f"{frame}_contact"] = reading.computed(
            1, lambda at=found: state.data.sensordata[at] > 0.0
        )
        # MuJoCo gives the force of the foot on the ground.
        readings[f"{frame}_contact_force"] = reading.sensor_values(force, negated=True)
    for side in robot.hands:
        links = _touching(robot, side)
        names = [f"{state.prefix}{side}_touch_{link}" for link in links]
        if names:
            forces = [_places(model, name)[1:] for name in names]
            readings[f"{side}_touch"] = _norms(state.data, forces)
    return {state.prefix + key: found for key, found in readings.items()}


def _feet(robot: RobotDescription) -> dict[str, str]:
    """Return the link of each foot by its frame."""
    return {f.name: f.link for f in robot.frames if f.role == "foot"}


def _touching(robot: RobotDescription, side: str) -> list[str]:
    """Return the links of a gripper with collision shapes, in the robot's order."""
    links = gripper_links(robot, side, robot.hands[side])
    return [k.name for k in robot.links if k.name in links and k.collision]


def _norms(data: mujoco.MjData, places: list[range]) -> Reading:
    """Read the norms of vectors in sensordata."""
    index = np.array(places)
    return reading.computed(
        len(index), lambda: np.linalg.norm(data.sensordata[index], axis=1)
    )


def _places(model: mujoco.MjModel, name: str) -> range:
    """Return the indices of a sensor's values in sensordata."""
    sensor = model.sensor(name)
    return range(sensor.adr[0], sensor.adr[0] + sensor.dim[0])
