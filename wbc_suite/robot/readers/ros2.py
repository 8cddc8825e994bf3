"""Write a robot as a ROS 2 description package: ros2_control, controllers, MoveIt."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias, cast
from xml.etree.ElementTree import Element, SubElement
from xml.sax.saxutils import escape

import numpy as np

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Frame, Joint, UrdfRoot
from wbc_suite.robot.poses import pose_fields, se3_of
from wbc_suite.robot.readers.files import file_stem, joint_gains, write_text
from wbc_suite.robot.readers.srdf import write_srdf
from wbc_suite.robot.shapes import Posed
from wbc_suite.robot.urdf_export import (
    Dialect,
    connection,
    numbers_text,
    urdf_text,
    urdf_tree,
)

Table: TypeAlias = Mapping[str, Any]

UPDATE_RATE = 500  # Hz; of our control loop
OPTICAL = Posed(quat=(0.0, 1.0, 0.0, 0.0))
"""Turns a camera (z backward, y up) into the optical frame of REP 103 (z forward)."""
INTERFACES = {"motor": "effort", "position": "position", "velocity": "velocity"}
"""Command interface by kind of actuator."""
TRAJECTORIES = "joint_trajectory_controller/JointTrajectoryController"
WORDS = {"y", "n", "yes", "no", "on", "off", "true", "false", "null"}
"""Names that YAML would take for a boolean or null without quotes."""

PACKAGE = """<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>1.0.0</version>
  <description>{title}: description, exported by wbc-suite</description>
  <maintainer email="maintainer@example.org">Maintainer</maintainer>
  <license>{license}</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <exec_depend>robot_state_publisher</exec_depend>
  <exec_depend>ros2_control</exec_depend>
  <exec_depend>ros2_controllers</exec_depend>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""
CMAKE = """cmake_minimum_required(VERSION 3.8)
project({name})
find_package(ament_cmake REQUIRED)
install(DIRECTORY config launch meshes srdf urdf DESTINATION share/${{PROJECT_NAME}})
ament_package()
"""
LAUNCH = """<launch>
  <node pkg="robot_state_publisher" exec="robot_state_publisher">
    <param name="robot_description" type="str"
      value="$(command 'cat $(find-pkg-share {name})/urdf/{stem}.urdf')"/>
  </node>
</launch>
"""


def write_ros2(robot: RobotDescription, folder: Path, root: UrdfRoot) -> str:
    """Write a package: URDF, SRDF, controllers, joint limits, meshes."""
    stem = file_stem(robot)
    name = f"{stem}_description"
    package = folder / name
    dialect = Dialect(mesh_prefix=f"package://{name}/")
    tree = urdf_tree(robot, dialect, mesh_dir=package / "meshes", root=root)
    tree.extend(_optical_frames(robot))
    tree.append(_control(robot))
    (package / "meshes").mkdir(parents=True, exist_ok=True)
    texts = {
        "package.xml": PACKAGE.format(
            name=name,
            title=escape(robot.title or robot.name),
            license=escape(robot.license or "unknown"),
        ),
        "CMakeLists.txt": CMAKE.format(name=name),
        "launch/description.launch.xml": LAUNCH.format(name=name, stem=stem),
        f"urdf/{stem}.urdf": urdf_text(tree),
        f"srdf/{stem}.srdf": write_srdf(robot, rooted=root != "none"),
        "config/controllers.yaml": yaml_text(_controllers(robot)),
        "config/joint_limits.yaml": yaml_text({"joint_limits": _limits(robot)}),
    }
    for path, text in texts.items():
        write_text(package / path, text)
    return (
        f"colcon build --packages-select {name}\n"
        f"ros2 launch {name} description.launch.xml"
    )


def _optical_frames(robot: RobotDescription) -> Iterator[Element]:
    for camera in robot.cameras:
        name = f"{camera.name}_optical_frame"
        pose = pose_fields(se3_of(camera) * se3_of(OPTICAL))
        frame = Frame(name=name, link=camera.link, **pose)
        yield Element("link", name=name)
        yield connection(f"{name}_fixed", "fixed", camera.link, name, frame)


def _interfaces(robot: RobotDescription) -> dict[str, str]:
    """Return the command interface of each joint that has a motor."""
    kinds = {actuator.joint: actuator.kind for actuator in robot.actuators}
    return {
        joint.name: INTERFACES[kinds.get(joint.name, "motor")]
        for joint in robot.joints
        if joint.independent and joint.effort
    }


def _control(robot: RobotDescription) -> Element:
    """Return `<ros2_control>` with simulated hardware; followers only have states."""
    element = Element("ros2_control", name=robot.name, type="system")
    hardware = SubElement(element, "hardware")
    SubElement(hardware, "plugin").text = "mock_components/GenericSystem"
    commands = _interfaces(robot)
    start = robot.keyframe("ready") if "ready" in robot.keyframes else robot.posture({})
    for joint in robot.joints:
        own = SubElement(element, "joint", name=joint.name)
        if joint.name in commands:
            kind = commands[joint.name]
            command = SubElement(own, "command_interface", name=kind)
            for key, bound in zip(("min", "max"), _bounds(joint, kind), strict=True):
                if np.isfinite(bound):
                    SubElement(command, "param", name=key).text = numbers_text(bound)
        position = SubElement(own, "state_interface", name="position")
        value = numbers_text(start[joint.name])
        SubElement(position, "param", name="initial_value").text = value
        SubElement(own, "state_interface", name="velocity")
        if commands.get(joint.name) == "effort":
            SubElement(own, "state_interface", name="effort")
    for name in commands:
        element.append(_transmission(name))
    return element


def _bounds(joint: Joint, interface: str) -> tuple[float, float]:
    if interface == "position" and joint.range is not None:
        return joint.range
    most = {"effort": joint.effort, "velocity": joint.velocity}.get(interface) or np.inf
    return -most, most


def _transmission(joint: str) -> Element:
    element = Element("transmission", name=f"{joint}_transmission")
    plugin = SubElement(element, "plugin")
    plugin.text = "transmission_interface/SimpleTransmission"
    SubElement(element, "actuator", name=f"{joint}_motor", role="motor")
    own = SubElement(element, "joint", name=joint, role="joint")
    SubElement(own, "mechanical_reduction").text = "1.0"
    return element


def _controllers(robot: RobotDescription) -> dict[str, Any]:
    """Return a trajectory controller for each group and interface, with gains."""
    interfaces, gains = _interfaces(robot), joint_gains(robot)
    manager: dict[str, Any] = {
        "update_rate": UPDATE_RATE,
        "joint_state_broadcaster": {
            "type": "joint_state_broadcaster/JointStateBroadcaster"
        },
    }
    content: dict[str, Any] = {"controller_manager": {"ros__parameters": manager}}
    for group, joints in robot.groups.items():
        kinds = dict.fromkeys(interfaces[j] for j in joints if j in interfaces)
        for kind in kinds:
            name = f"{group}_controller" if len(kinds) == 1 else f"{group}_{kind}"
            manager[name] = {"type": TRAJECTORIES}
            own = [joint for joint in joints if interfaces.get(joint) == kind]
            settings: dict[str, Any] = {
                "joints": own,
                "command_interfaces": [kind],
                "state_interfaces": ["position", "velocity"],
            }
            if kind != "position":  # the controller closes the loop itself
                rows = {j: gains[j] for j in own}
                settings["gains"] = {
                    j: {"p": p, "i": 0.0, "d": d} for j, (p, d) in rows.items()
                }
            content[name] = {"ros__parameters": settings}
    return content


def _limits(robot: RobotDescription) -> dict[str, Any]:
    """Return MoveIt's limits; URDF has none of accelerations."""
    return {
        joint.name: {
            "has_velocity_limits": joint.velocity is not None,
            "max_velocity": joint.velocity or 0.0,
            "has_acceleration_limits": joint.acceleration is not None,
            "max_acceleration": joint.acceleration or 0.0,
        }
        for joint in robot.joints
    }


def yaml_text(data: Table, indent: int = 0) -> str:
    """Write nested tables of numbers, booleans, texts and lists of texts as YAML."""
    lines: list[str] = []
    for key, value in data.items():
        head = f"{' ' * indent}{_scalar(key)}:"
        if isinstance(value, Mapping):
            lines += [head, yaml_text(cast(Table, value), indent + 2).rstrip("\n")]
        elif isinstance(value, list):
            items = map(_scalar, cast(list[str], value))
            lines.append(f"{head} [{', '.join(items)}]")
        else:
            lines.append(f"{head} {_scalar(value)}")
    return "\n".join(lines) + "\n"


def _scalar(value: str | float) -> str:
    """Write a name, a boolean or a number; YAML's exponents need a decimal point."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        text = repr(value)
        return text if "." in text else text.replace("e", ".0e")
    return f'"{value}"' if str(value).lower() in WORDS else str(value)
