"""Write a robot as URDF with Drake's own elements.

Source: drake.mit.edu, "Parsing Models for MultibodyPlant".
"""

import itertools
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

import pinocchio as pin

from wbc_suite.robot.collision_capsules import collision_pairs
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Joint, UrdfRoot
from wbc_suite.robot.poses import se3_of
from wbc_suite.robot.readers.files import file_stem, joint_gains, write_text
from wbc_suite.robot.urdf_export import (
    Dialect,
    numbers_text,
    urdf_text,
    urdf_tree,
)

DIALECT = Dialect(planar=False, capsule="drake:capsule", frames=False, mesh="obj")


def write_drake(robot: RobotDescription, folder: Path, root: UrdfRoot) -> str:
    """Write a URDF with accelerations, rotor inertias, gains, frames and filters.

    Frames are frames of Drake, not bodies; hulls are convex. Drake adds a floating
    joint to a first link that nothing connects to the world.
    """
    tree = urdf_tree(robot, DIALECT, mesh_dir=folder / "meshes", root=root)
    tree.set("xmlns:drake", "https://drake.mit.edu")
    joints = {joint.name: joint for joint in robot.joints}
    for element in tree.iter("joint"):
        joint, limit = joints.get(element.get("name", "")), element.find("limit")
        if joint is not None and limit is not None and joint.acceleration:
            limit.set("drake:acceleration", numbers_text(joint.acceleration))
    for mesh in tree.iterfind("link/collision/geometry/mesh"):
        SubElement(mesh, "drake:declare_convex")
    tree.extend(_frames(robot))
    tree.extend(_transmissions(robot, base=root == "planar"))
    tree.extend(_filters(robot))
    path = folder / f"{file_stem(robot)}.urdf"
    write_text(path, urdf_text(tree))
    return (
        f'Parser(plant).AddModels("{path}")\n'
        "Mimic joints need plant.set_discrete_contact_approximation(kSap)."
    )


def _frames(robot: RobotDescription) -> Iterator[Element]:
    for frame in robot.frames:
        pose = se3_of(frame)
        xyz = numbers_text(pose.translation)
        rpy = numbers_text(pin.rpy.matrixToRpy(pose.rotation))
        yield Element("frame", name=frame.name, link=frame.link, xyz=xyz, rpy=rpy)


def _transmissions(robot: RobotDescription, *, base: bool) -> Iterator[Element]:
    """Yield one for each motor; rotor inertias are those seen at the joints."""
    gains, stated = joint_gains(robot), {a.joint for a in robot.actuators}
    driven: list[Joint] = [j for j in robot.joints if j.name in gains]
    if base and robot.root.actuated:
        driven = [*robot.root.joints, *driven]
    for joint in driven:
        element = Element("transmission", name=f"{joint.name}_transmission")
        kind = SubElement(element, "type")
        kind.text = "transmission_interface/SimpleTransmission"
        SubElement(element, "joint", name=joint.name)
        motor = SubElement(element, "actuator", name=joint.name)
        inertia = numbers_text(joint.armature)
        SubElement(motor, "drake:rotor_inertia", value=inertia)
        SubElement(motor, "drake:gear_ratio", value="1.0")
        if joint.name in stated:
            p, d = map(numbers_text, gains[joint.name])
            SubElement(motor, "drake:controller_gains", p=p, d=d)
        yield element


def _filters(robot: RobotDescription) -> Iterator[Element]:
    """Yield a group for each link, which ignores those that it never collides with."""
    shaped = [link.name for link in robot.links if link.collision]
    enabled = collision_pairs(robot)
    ignored: dict[str, list[str]] = {name: [] for name in shaped}
    for one, other in itertools.combinations(shaped, 2):
        if frozenset((one, other)) not in enabled:
            ignored[one].append(other)
    for link, others in ignored.items():
        group = Element("drake:collision_filter_group", name=f"group_{link}")
        SubElement(group, "drake:member", link=link)
        for other in others:
            tag = "drake:ignored_collision_filter_group"
            SubElement(group, tag, name=f"group_{other}")
        yield group
