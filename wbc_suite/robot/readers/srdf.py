"""Write the semantics of a robot as SRDF: groups, postures, pairs, end effectors.

MoveIt and Pinocchio read it beside the URDF.
"""

import itertools
from collections.abc import Iterator
from xml.etree.ElementTree import Element, SubElement

from wbc_suite.robot.collision_capsules import collision_pairs
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import rigid_bodies
from wbc_suite.robot.urdf_export import ROOT_TYPES, numbers_text, urdf_text

WHOLE = "whole_body"
"""Group of all groups; its states are Pinocchio's reference configurations."""
FREE_FLYER = "root_joint"
"""Name of the root joint that Pinocchio's URDF reader adds."""


def write_srdf(
    robot: RobotDescription, *, rooted: bool, pinocchio: bool = False
) -> str:
    """Write a robot's groups, postures, end effectors and disabled pairs as SRDF text.

    Disabled are all pairs of links with collision shapes that `collision_pairs` lacks.
    A posture is a state of the group of all joints, and of each group.

    Args:
        robot: The robot.
        rooted: Whether the URDF connects the robot to a link `world`; otherwise a
            virtual joint does.
        pinocchio: Add rotor parameters, and the pose of a free root in postures.
    """
    tree = Element("robot", name=robot.name)
    first, kind = robot.links[0].name, ROOT_TYPES[robot.root.kind]
    if not rooted:
        fields = {"parent_frame": "world", "child_link": first}
        SubElement(tree, "virtual_joint", {"name": "root", "type": kind} | fields)
    for name, joints in robot.groups.items():
        group = SubElement(tree, "group", name=name)
        for joint in joints:
            SubElement(group, "joint", name=joint)
    whole = SubElement(tree, "group", name=WHOLE)
    for name in robot.groups:
        SubElement(whole, "group", name=name)
    tree.extend(_states(robot, free=pinocchio and not rooted))
    tree.extend(_end_effectors(robot))
    for joint in robot.joints:
        if joint.passive:
            SubElement(tree, "passive_joint", name=joint.name)
    tree.extend(_disabled(robot))
    if pinocchio:
        tree.append(_rotors(robot))
    return urdf_text(tree)


def _states(robot: RobotDescription, *, free: bool) -> Iterator[Element]:
    """Yield the states; Pinocchio keeps the first of each name."""
    for name in robot.keyframes:
        values = robot.keyframe(name)
        groups = {WHOLE: robot.joint_names, **robot.groups}
        for group, joints in groups.items():
            state = Element("group_state", name=name, group=group)
            if free and group == WHOLE and robot.root.kind == "free":
                w, *xyz = robot.root.quat
                pose = numbers_text((*robot.root.pos, *xyz, w))
                SubElement(state, "joint", name=FREE_FLYER, value=pose)
            for joint in joints:
                SubElement(
                    state, "joint", name=joint, value=numbers_text(values[joint])
                )
            yield state


def _end_effectors(robot: RobotDescription) -> Iterator[Element]:
    """Yield the grippers, each with the group that carries it."""
    rigid = rigid_bodies(robot.links)
    moved = {link.joint.name: link for link in robot.links if link.joint is not None}
    group_of = {j: name for name, joints in robot.groups.items() for j in joints}
    for gripper in robot.synergies:
        joints = robot.groups.get(gripper, ())
        if not joints:
            continue
        carrier = robot.link(rigid[str(moved[joints[0]].parent)])
        while carrier.joint and group_of.get(carrier.joint.name) == gripper:
            carrier = robot.link(rigid[str(carrier.parent)])
        fields = {"parent_link": carrier.name, "group": gripper}
        if carrier.joint is not None and carrier.joint.name in group_of:
            fields["parent_group"] = group_of[carrier.joint.name]
        yield Element("end_effector", {"name": f"{gripper}_end"} | fields)


def _disabled(robot: RobotDescription) -> Iterator[Element]:
    shaped = [link.name for link in robot.links if link.collision]
    rigid, enabled = rigid_bodies(robot.links), collision_pairs(robot)
    parent = {link.name: rigid[link.parent] for link in robot.links if link.parent}
    for one, other in itertools.combinations(shaped, 2):
        if frozenset((one, other)) in enabled:
            continue
        a, b = rigid[one], rigid[other]
        near = a == b or parent.get(a) == b or parent.get(b) == a
        fields = {
            "link1": one,
            "link2": other,
            "reason": "Adjacent" if near else "User",
        }
        yield Element("disable_collisions", fields)


def _rotors(robot: RobotDescription) -> Element:
    """Return rotor inertias seen at the joints, with gear ratios of 1."""
    element = Element("rotor_params")
    for joint in robot.joints:
        if joint.armature:
            inertia = numbers_text(joint.armature)
            SubElement(
                element, "joint", name=joint.name, mass=inertia, gear_ratio="1.0"
            )
    return element
