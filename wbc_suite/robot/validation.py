"""Check a robot description: names, tree, physics, references."""

import itertools
from collections.abc import Collection, Iterator, Mapping

from wbc_suite.errors import did_you_mean, join_first
from wbc_suite.robot.elements import Elements, Link, Synergy, rigid_bodies
from wbc_suite.robot.inertia import implausible, unphysical

RESERVED = ("root", "root_x", "root_y", "root_yaw", "world")
"""Names of the root's joints and of the world; links, joints and frames differ."""

Synergies = Mapping[str, tuple[Synergy, ...]]
"""Gripper commands, by gripper."""


def check_description(robot: Elements, synergies: Synergies) -> None:
    """Raise ValueError with the first faults found, each as one sentence."""
    faults = [
        *_tree_faults(robot),
        *_mass_faults(robot),
        *_name_faults(robot),
        *(fault for link in robot.links for fault in _inertia_faults(link)),
        *_reference_faults(robot, synergies),
        *_shape_faults(robot),
        *_mimic_faults(robot),
        *_keyframe_faults(robot),
        *_group_faults(robot),
    ]
    if faults:
        shown = [fault.removesuffix(".") for fault in faults]
        raise ValueError(join_first(shown, separator="; "))


def _unknown(kind: str, name: str, known: Collection[str], where: str) -> str:
    hint = did_you_mean(name, known)
    return f"{where} names {kind} '{name}', which does not exist.{hint}"


def _tree_faults(robot: Elements) -> Iterator[str]:
    names = {link.name for link in robot.links}
    roots = [link.name for link in robot.links if link.parent is None]
    if len(roots) != 1:
        yield f"exactly one link must have no parent, found {len(roots)}: {roots}"
    seen: set[str] = set()
    for link in robot.links:
        if link.parent is not None and link.parent not in names:
            yield _unknown("parent", link.parent, names, f"link '{link.name}'")
        elif link.parent is not None and link.parent not in seen:
            yield (
                f"link '{link.name}' comes before its parent '{link.parent}', or the "
                "two form a loop"
            )
        seen.add(link.name)
    if robot.links and robot.links[0].joint is not None:
        yield f"the first link '{robot.links[0].name}' has a joint; use [root] instead"


def _mass_faults(robot: Elements) -> Iterator[str]:
    """Check that every moving rigid body has a mass and an inertia tensor."""
    rigid = rigid_bodies(robot.links)
    heavy = {rigid[link.name] for link in robot.links if link.mass > 0.0}
    turning = {rigid[link.name] for link in robot.links if any(link.inertia)}
    for link in robot.links:
        first = link is robot.links[0] and robot.root.kind != "fixed"
        if first or link.joint is not None:
            if link.name not in heavy:
                yield f"link '{link.name}' moves and needs a mass"
            elif link.name not in turning:
                yield f"link '{link.name}' moves and needs an inertia"


def _name_faults(robot: Elements) -> Iterator[str]:
    owner: dict[str, str] = dict.fromkeys(RESERVED, "a reserved name")
    items = [("link", link.name) for link in robot.links]
    items += [("joint", name) for name in robot.joint_names]
    items += [("frame", frame.name) for frame in robot.frames]
    for kind, name in items:
        if name in owner:
            yield f"{kind} '{name}' repeats {owner[name]}"
        owner.setdefault(name, f"the name of a {kind}")
    for kind, own in (
        ("camera", robot.cameras),
        ("sensor", robot.sensors),
        ("mount", robot.mounts),
        ("tendon", robot.tendons),
    ):
        names = [item.name for item in own]
        for name in sorted({n for n in names if names.count(n) > 1}):
            yield f"{kind} '{name}' is defined twice"


def _inertia_faults(link: Link) -> Iterator[str]:
    where = f"link '{link.name}'"
    fault = unphysical(link)
    if fault is not None:
        yield f"{where}: {fault}"
        return
    for rule, text in implausible(link):
        if rule not in link.accept:
            yield f"{where}: {text}"


def _reference_faults(robot: Elements, synergies: Synergies) -> Iterator[str]:
    known = {
        "link": [link.name for link in robot.links],
        "frame": [frame.name for frame in robot.frames],
        "joint": list(robot.joint_names),
    }
    for where, kind, name in _references(robot, synergies):
        if name not in known[kind]:
            yield _unknown(kind, name, known[kind], where)


def _references(
    robot: Elements, synergies: Synergies
) -> Iterator[tuple[str, str, str]]:
    """Yield every reference by name: (where, kind, name)."""
    for item in (*robot.frames, *robot.mounts, *robot.cameras):
        yield f"{type(item).__name__.lower()} '{item.name}'", "link", item.link
    for sensor in robot.sensors:
        yield f"sensor '{sensor.name}'", "frame", sensor.frame
    for actuator in robot.actuators:
        yield "an actuator", "joint", actuator.joint
    wheels = [joint for w in robot.wheels for joint in (w.joint, w.steering) if joint]
    yield from (("a wheel", "joint", joint) for joint in wheels)
    for name in itertools.chain(*robot.contacts.exclude):
        yield "contacts.exclude", "link", name
    for name in itertools.chain(*((c.link, c.other) for c in robot.connects)):
        yield "a connect", "link", name
    for name, step in ((t.name, step) for t in robot.tendons for step in t.path):
        kind = "frame" if step.joint is None else "joint"
        yield f"tendon '{name}'", kind, str(step.joint or step.frame)
    for gripper, own in synergies.items():
        for synergy, joint in ((s.name, joint) for s in own for joint in s.open):
            yield f"synergy '{synergy}' of '{gripper}'", "joint", joint


def _shape_faults(robot: Elements) -> Iterator[str]:
    known = {*robot.materials, "grey"}
    for link in robot.links:
        for shape in link.visual:
            if isinstance(shape.color, str) and shape.color not in known:
                yield _unknown("material", shape.color, known, f"link '{link.name}'")
        for shape in link.collision:
            if shape.shape == "loft":
                yield (
                    f"link '{link.name}': a loft may be non-convex and cannot "
                    "collide; use a hull"
                )


def _mimic_faults(robot: Elements) -> Iterator[str]:
    joints = {joint.name: joint for joint in robot.joints}
    for joint in robot.joints:
        if joint.mimic is None:
            continue
        leader = joints.get(joint.mimic.joint)
        where = f"joint '{joint.name}'"
        if leader is None:
            yield _unknown("leader", joint.mimic.joint, joints, where)
        elif leader.mimic is not None:
            yield f"{where} follows '{leader.name}', which itself follows another"
        elif joint.mimic.closed and not robot.connects:
            yield f"{where} has 'mimic.closed', but the robot has no [[connect]]"


def _keyframe_faults(robot: Elements) -> Iterator[str]:
    joints = {joint.name: joint for joint in robot.joints}
    for name, values in robot.keyframes.items():
        for joint_name, value in values.items():
            joint = joints.get(joint_name)
            if joint is None:
                yield _unknown("joint", joint_name, joints, f"keyframe '{name}'")
            elif joint.range and not joint.range[0] <= value <= joint.range[1]:
                yield (
                    f"keyframe '{name}': {joint_name} = {value} is outside "
                    f"{list(joint.range)}"
                )


def _group_faults(robot: Elements) -> Iterator[str]:
    """Check that the groups partition the joints that have a motor."""
    joints = {joint.name: joint for joint in robot.joints}
    owner: dict[str, str] = {}
    for group, members in robot.groups.items():
        for name in members:
            if name not in joints:
                yield _unknown("joint", name, joints, f"group '{group}'")
            elif name in owner:
                yield f"joint '{name}' is in two groups, '{owner[name]}' and '{group}'"
            owner[name] = group
    for joint in robot.joints:
        if robot.groups and joint.independent and joint.name not in owner:
            yield f"joint '{joint.name}' is in no group (or mark it passive)"
