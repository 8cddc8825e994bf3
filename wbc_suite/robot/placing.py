"""Small transformations of parts on their way into an assembly."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import pinocchio as pin

from wbc_suite.errors import UnknownNameError
from wbc_suite.robot.parts import Joint, Link
from wbc_suite.robot.shapes import Posed, Shape, SkinMesh

if TYPE_CHECKING:
    from wbc_suite.robot.component import Component

__all__ = [
    "compose",
    "depth_first",
    "locked",
    "painted",
    "pose_fields",
    "renamed",
    "repainted",
    "se3_of",
]

S = TypeVar("S", bound=Shape | SkinMesh)


def se3_of(posed: Posed) -> Any:
    """Return the pose of a described item as `pinocchio.SE3`."""
    rotation = pin.Quaternion(*posed.quat).matrix()
    return pin.SE3(rotation, np.asarray(posed.pos))


def pose_fields(pose: Any) -> dict[str, Any]:
    """Return `pos` and `quat` of a `pinocchio.SE3`."""
    x, y, z, w = pin.Quaternion(pose.rotation).normalized().coeffs().tolist()
    return {"pos": tuple(pose.translation.tolist()), "quat": (w, x, y, z)}


def compose(*items: Posed) -> dict[str, Any]:
    """Chain poses; an identity link keeps the mount's figures to the last digit."""
    moved = [i for i in items if i.pos != (0, 0, 0) or i.quat != (1, 0, 0, 0)]
    if not moved:
        return {"pos": (0.0, 0.0, 0.0), "quat": (1.0, 0.0, 0.0, 0.0)}
    if len(moved) == 1:
        return {"pos": moved[0].pos, "quat": moved[0].quat}
    pose = pin.SE3.Identity()
    for item in moved:
        pose = pose * se3_of(item)
    return pose_fields(pose)


def depth_first(links: tuple[Link, ...]) -> tuple[Link, ...]:
    """Order links depth-first, as both engines number their joints.

    Links that hang on nothing known come last, in their own order, for the validation
    to find.
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


def renamed(
    component: "Component", *, items: str, bodies: str, part: str
) -> "Component":
    """Prefix names: `items` those of frames, groups and the like, `bodies` the rest.

    A group that is called `gripper` takes the name of its part.
    """
    links = tuple(_renamed_link(link, bodies) for link in component.links)
    update: dict[str, Any] = {
        "links": links,
        "groups": {
            (part if group == "gripper" else items + group): _all(joints, bodies)
            for group, joints in component.groups.items()
        },
        "keyframes": {
            name: {bodies + joint: value for joint, value in values.items()}
            for name, values in component.keyframes.items()
        },
        "contacts": component.contacts.model_copy(
            update={
                "exclude": tuple(
                    _all(pair, bodies) for pair in component.contacts.exclude
                )
            }
        ),
        "synergies": tuple(
            synergy.model_copy(
                update={
                    "open": {bodies + j: v for j, v in synergy.open.items()},
                    "closed": {bodies + j: v for j, v in synergy.closed.items()},
                }
            )
            for synergy in component.synergies
        ),
    }
    for field in ("frames", "cameras", "sensors", "actuators", "connects"):
        update[field] = tuple(
            item.model_copy(update=_item_names(item, items, bodies))
            for item in getattr(component, field)
        )
    update["mounts"] = tuple(
        mount.model_copy(update={"link": bodies + mount.link})
        for mount in component.mounts
    )
    return component.model_copy(update=update)


def repainted(component: "Component", colors: Mapping[str, str]) -> "Component":
    """Give materials other names, so that equal ones of two parts stay apart."""
    if not colors:
        return component
    links = tuple(
        link.model_copy(update={"visual": painted(link.visual, colors)})
        for link in component.links
    )
    materials = {colors.get(n, n): rgba for n, rgba in component.materials.items()}
    return component.model_copy(update={"links": links, "materials": materials})


def painted(shapes: tuple[S, ...], colors: Mapping[str, str]) -> tuple[S, ...]:
    """Return shapes with other names of materials."""
    return tuple(
        shape.model_copy(update={"color": colors[shape.color]})
        if isinstance(shape.color, str) and shape.color in colors
        else shape
        for shape in shapes
    )


def _all(names: tuple[str, ...], prefix: str) -> tuple[str, ...]:
    return tuple(prefix + name for name in names)


def _item_names(item: Any, items: str, bodies: str) -> dict[str, str]:
    """New names of one frame, camera, sensor, actuator or connect."""
    prefix = {
        "name": items,
        "frame": items,
        "link": bodies,
        "other": bodies,
        "joint": bodies,
    }
    return {
        key: p + getattr(item, key) for key, p in prefix.items() if hasattr(item, key)
    }


def _renamed_link(link: Link, prefix: str) -> Link:
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


def locked(data: dict[str, Any], groups: tuple[str, ...]) -> dict[str, Any]:
    """Fix the joints of some groups in their `ready` values.

    Raises:
        UnknownNameError: If a group does not exist.
    """
    if not groups:
        return data
    for group in groups:
        if group not in data["groups"]:
            raise UnknownNameError("group", group, data["groups"])
    names = {joint for group in groups for joint in data["groups"][group]}
    followers = {
        link.joint.name
        for link in data["links"]
        if link.joint and link.joint.mimic and link.joint.mimic.joint in names
    }
    names |= followers
    ready = data["keyframes"].get("ready", {})
    return data | {
        "links": tuple(_fixed_link(link, names, ready) for link in data["links"]),
        "groups": {g: j for g, j in data["groups"].items() if g not in groups},
        "keyframes": {
            name: {j: v for j, v in values.items() if j not in names}
            for name, values in data["keyframes"].items()
        },
        "actuators": [a for a in data["actuators"] if a.joint not in names],
        "synergies": {g: s for g, s in data["synergies"].items() if g not in groups},
    }


def _fixed_link(link: Link, names: set[str], values: dict[str, float]) -> Link:
    if link.joint is None or link.joint.name not in names:
        return link
    value = values.get(link.joint.name, 0.0)
    if link.joint.mimic is not None:
        leader = values.get(link.joint.mimic.joint, 0.0)
        value = link.joint.mimic.ratio * leader + link.joint.mimic.offset
    pose = pose_fields(se3_of(link) * _motion(link.joint, value))
    return link.model_copy(update=pose | {"joint": None})


def _motion(joint: Joint, value: float) -> Any:
    axis = np.asarray(joint.axis)
    if joint.type == "slide":
        return pin.SE3(np.eye(3), value * axis)
    return pin.SE3(pin.AngleAxis(value, axis).matrix(), np.zeros(3))
