"""Steps of an assembly: order links, prefix names, rename colours, lock joints."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from pydantic import BaseModel

from wbc_suite.errors import look_up
from wbc_suite.robot.elements import Link
from wbc_suite.robot.poses import joint_motion, pose_fields, se3_of
from wbc_suite.robot.shapes import Drawn, Shape

LISTS = ("frames", "cameras", "actuators", "sensors", "connects", "tendons", "wheels")
"""Lists of a component that are joined in an assembly."""

if TYPE_CHECKING:
    from wbc_suite.robot.robot_file import Component

S = TypeVar("S", bound=Shape | Drawn)
M = TypeVar("M", bound=BaseModel)


def depth_first(links: tuple[Link, ...]) -> tuple[Link, ...]:
    """Order links depth-first, as engines number joints; unconnected ones come last."""
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

    Links and joints get `bodies`; frames, cameras, sensors and groups get `items`. A
    group `gripper` gets the name of the part.
    """
    in_link: dict[str, str] = dict.fromkeys(("name", "parent", "joint"), bodies)
    elsewhere: dict[str, str] = dict.fromkeys(("link", "other", "joint"), bodies)

    def all_of(names: Iterable[str]) -> tuple[str, ...]:
        return tuple(bodies + name for name in names)

    def values(positions: Mapping[str, float]) -> dict[str, float]:
        return {bodies + joint: value for joint, value in positions.items()}

    update: dict[str, Any] = {
        "links": tuple(_prefixed(link, in_link) for link in component.links),
        "mounts": tuple(_prefixed(mount, elsewhere) for mount in component.mounts),
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
    }
    elsewhere |= {"name": items, "frame": items, "steering": bodies}
    for field in LISTS:
        own = getattr(component, field)
        update[field] = tuple(_prefixed(item, elsewhere) for item in own)
    return component.model_copy(update=update)


def _prefixed(item: M, prefixes: Mapping[str, str]) -> M:
    """Prefix the names under some keys of an item, and of the models in it."""
    update: dict[str, Any] = {}
    for key, value in item:
        if isinstance(value, BaseModel):
            update[key] = _prefixed(value, prefixes)
        elif key == "path":  # of a tendon
            steps = cast("tuple[BaseModel, ...]", value)
            update[key] = tuple(_prefixed(step, prefixes) for step in steps)
        elif isinstance(value, str) and key in prefixes:
            update[key] = prefixes[key] + value
    return item.model_copy(update=update)


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
    """Fix joints of groups, in fields of a description, at their `ready` values."""
    names = {j for group in groups for j in look_up("group", group, data["groups"])}
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
        "wheels": [w for w in data["wheels"] if not {w.joint, w.steering} & names],
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
