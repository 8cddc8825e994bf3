"""Steps of an assembly: order links, prefix names, rename colours, lock joints."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from wbc_suite.errors import UnknownNameError
from wbc_suite.robot.elements import Link
from wbc_suite.robot.poses import joint_motion, pose_fields, se3_of
from wbc_suite.robot.shapes import Shape, SkinMesh

if TYPE_CHECKING:
    from wbc_suite.robot.robot_file import Component

S = TypeVar("S", bound=Shape | SkinMesh)


def depth_first(links: tuple[Link, ...]) -> tuple[Link, ...]:
    """Order links depth-first, as both engines number their joints.

    Links that are not connected to the root come last, in their own order; the
    validation reports them.
    """
    children: dict[str | None, list[Link]] = {}
    for link in links:
        children.setdefault(link.parent, []).append(link)
    ordered: list[Link] = []
    seen: set[int] = set()
    stack = list(reversed(children.get(None, [])))
    while stack:
        link = stack.pop()
        if id(link) in seen:
            continue
        seen.add(id(link))
        ordered.append(link)
        stack.extend(reversed(children.get(link.name, [])))
    return (*ordered, *(link for link in links if id(link) not in seen))


def prefixed(
    component: "Component", *, items: str, bodies: str, part: str
) -> "Component":
    """Prefix the names of a component.

    Args:
        component: The component.
        items: Prefix of frames, cameras, sensors and groups.
        bodies: Prefix of links and joints.
        part: New name of a group `gripper`.
    """

    def all_of(names: Iterable[str]) -> tuple[str, ...]:
        return tuple(bodies + name for name in names)

    def values(positions: Mapping[str, float]) -> dict[str, float]:
        return {bodies + joint: value for joint, value in positions.items()}

    update: dict[str, Any] = {
        "links": tuple(_prefixed_link(link, bodies) for link in component.links),
        "groups": {
            (part if group == "gripper" else items + group): all_of(joints)
            for group, joints in component.groups.items()
        },
        "keyframes": {n: values(own) for n, own in component.keyframes.items()},
        "contacts": component.contacts.model_copy(
            update={"exclude": tuple(map(all_of, component.contacts.exclude))}
        ),
        "synergies": tuple(
            s.model_copy(update={"open": values(s.open), "closed": values(s.closed)})
            for s in component.synergies
        ),
        "mounts": tuple(
            mount.model_copy(update={"link": bodies + mount.link})
            for mount in component.mounts
        ),
    }
    prefixes = {"name": items, "frame": items}
    prefixes |= dict.fromkeys(("link", "other", "joint"), bodies)
    for field in ("frames", "cameras", "sensors", "actuators", "connects"):
        update[field] = tuple(
            item.model_copy(
                update={
                    key: prefix + getattr(item, key)
                    for key, prefix in prefixes.items()
                    if hasattr(item, key)
                }
            )
            for item in getattr(component, field)
        )
    return component.model_copy(update=update)


def _prefixed_link(link: Link, prefix: str) -> Link:
    if not prefix:
        return link
    update: dict[str, Any] = {"name": prefix + link.name}
    if link.parent is not None:
        update["parent"] = prefix + link.parent
    if link.joint is not None:
        joint: dict[str, Any] = {"name": prefix + link.joint.name}
        if link.joint.mimic is not None:
            leader = prefix + link.joint.mimic.joint
            joint["mimic"] = link.joint.mimic.model_copy(update={"joint": leader})
        update["joint"] = link.joint.model_copy(update=joint)
    return link.model_copy(update=update)


def recolored(component: "Component", colors: Mapping[str, str]) -> "Component":
    """Rename materials, so that equal names of two parts can have two colours."""
    if not colors:
        return component
    links = tuple(
        link.model_copy(update={"visual": with_colors(link.visual, colors)})
        for link in component.links
    )
    materials = {colors.get(n, n): rgba for n, rgba in component.materials.items()}
    return component.model_copy(update={"links": links, "materials": materials})


def with_colors(shapes: tuple[S, ...], colors: Mapping[str, str]) -> tuple[S, ...]:
    """Return shapes with renamed materials."""
    return tuple(
        shape.model_copy(update={"color": colors[shape.color]})
        if isinstance(shape.color, str) and shape.color in colors
        else shape
        for shape in shapes
    )


def locked(data: dict[str, Any], groups: tuple[str, ...]) -> dict[str, Any]:
    """Fix the joints of some groups at their `ready` values.

    Args:
        data: Fields of a `RobotDescription`.
        groups: Names of groups.

    Raises:
        UnknownNameError: If a group does not exist.
    """
    if not groups:
        return data
    for group in groups:
        if group not in data["groups"]:
            raise UnknownNameError("group", group, data["groups"])
    names = {joint for group in groups for joint in data["groups"][group]}
    names |= {
        link.joint.name
        for link in data["links"]
        if link.joint and link.joint.mimic and link.joint.mimic.joint in names
    }
    ready = data["keyframes"].get("ready", {})
    return data | {
        "links": tuple(_locked_link(link, names, ready) for link in data["links"]),
        "groups": {g: j for g, j in data["groups"].items() if g not in groups},
        "keyframes": {
            name: {j: v for j, v in values.items() if j not in names}
            for name, values in data["keyframes"].items()
        },
        "actuators": [a for a in data["actuators"] if a.joint not in names],
        "synergies": {g: s for g, s in data["synergies"].items() if g not in groups},
    }


def _locked_link(link: Link, names: set[str], values: dict[str, float]) -> Link:
    joint = link.joint
    if joint is None or joint.name not in names:
        return link
    value = values.get(joint.name, 0.0)
    if joint.mimic is not None:
        leader = values.get(joint.mimic.joint, 0.0)
        value = joint.mimic.ratio * leader + joint.mimic.offset
    motion = joint_motion(np.asarray(joint.axis), value, slide=joint.type == "slide")
    pose = pose_fields(se3_of(link) * motion)
    return link.model_copy(update=pose | {"joint": None})
