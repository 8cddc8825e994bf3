"""robosuite's names of elements in a scene, and ours."""

from collections.abc import Iterable
from typing import Any

import mujoco


def aliases_of(model: mujoco.MjModel, robots: Iterable[Any]) -> dict[str, Any]:
    """Return robosuite's names by kind: of objects, tables, arms and grippers.

    Objects: bodies `{name}_main`, joints `{name}_joint0`, geoms `{name}_g0`, ...
    Robots: `robot0_joint1`, `robot0_link1`, `robot0_base`, `robot0_right_hand`,
    `robot0_eye_in_hand`, `robot0_torq_j1`; grippers: `gripper0_right_grip_site`,
    `gripper0_right_finger_joint1`, `gripper0_right_force_ee`.
    """
    found: dict[str, dict[str, str]] = {
        k: {} for k in ("body", "joint", "geom", "site", "camera", "actuator", "sensor")
    }
    for index in range(model.nbody):
        _object(model, index, found)
    for robot in robots:
        _robot(robot, found)
        for arm in robot.arms:
            _gripper(robot, arm, found)
    return found


def _object(model: mujoco.MjModel, index: int, found: dict[str, Any]) -> None:
    body = model.body(index)
    if not body.name or body.name.startswith("robot"):
        return
    name = body.name
    found["body"][f"{name}_main"] = name
    for k in range(body.jntnum[0]):
        joint = model.joint(int(body.jntadr[0]) + k).name
        found["joint"][f"{name}_joint{k}"] = joint
    for k in range(body.geomnum[0]):
        geom = model.geom(int(body.geomadr[0]) + k).name
        found["geom"][f"{name}_g{k}"] = geom
        if k == 0:
            for role in ("collision", "visual"):
                found["geom"][f"{name}_{role}"] = geom


def _robot(robot: Any, found: dict[str, Any]) -> None:
    model, prefix = robot.robot_model, robot.robot_model.naming_prefix
    own = model.description
    found["body"][f"{prefix}base"] = model.root_body
    numbers: dict[str, int] = {}
    several = len(own.hands) > 1
    for name in model.arm_joints:
        joint = name.removeprefix(prefix)
        arm = next((g for g, js in own.groups.items() if joint in js), "")
        side = f"{arm.removesuffix('_arm')}_" if several else ""
        k = numbers[side] = numbers.get(side, 0) + 1
        found["joint"][f"{prefix}{side}joint{k}"] = name
        found["actuator"][f"{prefix}{side}torq_j{k}"] = name
        link = next(link.name for link in own.links if link.joint == own.joint(joint))
        found["body"][f"{prefix}{side}link{k}"] = prefix + link
    for arm, frame in own.hands.items():
        found["body"][f"{prefix}{arm}_hand"] = prefix + own.link_of(frame)
        found["camera"][f"{prefix}eye_in_hand"] = f"{prefix}{arm}_eye_in_hand"
    for frame in own.frames:
        found["site"][f"{prefix}{frame.name}"] = prefix + frame.name


def _gripper(robot: Any, arm: str, found: dict[str, Any]) -> None:
    gripper = robot.gripper[arm]
    start = f"gripper{robot.idn}_{arm}_"
    for name in gripper.important_sites.values():
        found["site"][name] = gripper.site
    for role, name in gripper.important_sensors.items():
        found["sensor"][name] = gripper.sensor(role)
    for k, joint in enumerate(gripper.joints, 1):
        found["joint"][f"{start}finger_joint{k}"] = joint
        found["actuator"][f"{start}gripper_finger_joint{k}"] = joint
    for name, geom in gripper.geom_names.items():
        found["geom"][start + name] = geom
    found["body"][f"{start}eef"] = robot.robot_model.eef_name[arm]
    for role, geoms in gripper.important_geoms.items():
        for k, geom in enumerate(geoms):
            side = role.replace("_finger", "finger").replace("fingerpad", "_pad")
            found["geom"][f"{start}{side}_collision"] = geom
            found["geom"][f"{start}{role}_g{k}"] = geom
