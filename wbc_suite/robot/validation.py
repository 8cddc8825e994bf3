"""Check a robot description: names, tree, physics, references.

MuJoCo and Pinocchio would find some of these faults too, but late and in their words.
"""

import itertools
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from wbc_suite.errors import nearest_name
from wbc_suite.robot.shapes import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Hull,
    Shape,
    Sphere,
    kept_by_shape,
)
from wbc_suite.typing import Matrix, Vector

if TYPE_CHECKING:
    from wbc_suite.robot.description import RobotDescription
    from wbc_suite.robot.parts import Joint, Link

__all__ = [
    "RESERVED",
    "check_description",
    "implausible",
    "inertia_matrix",
    "rigid_bodies",
    "shape_bounds",
    "unphysical",
]

INERTIA_SLACK = 1e-6
"""Relative slack of the triangle inequality; vendors round their tensors."""
GYRATION_RANGE = (0.08, 1.1)
"""Plausible radius of gyration over half the diagonal of the link's shapes."""
SMALLEST_MASS = 1e-9
"""A mass below is a mistake, kg; MuJoCo refuses from 1e-15 on."""
SMALLEST_MOMENT = 1e-14
"""Principal moments below count as not positive, kg m^2."""
COM_SLACK = 0.10
"""The centre of mass may leave the box of the link's shapes by this part of it."""

RESERVED = ("root", "root_x", "root_y", "root_yaw", "world")


def check_description(robot: "RobotDescription") -> None:
    """Raise ValueError with every fault found, each as one sentence."""
    faults = [
        *_tree(robot),
        *_moving(robot),
        *_names(robot),
        *(fault for link in robot.links for fault in _link(link)),
        *_references(robot),
        *_mimics(robot),
        *_keyframes(robot),
        *_groups(robot),
    ]
    if faults:
        shown = "; ".join(faults[:6])
        more = f"; ... and {len(faults) - 6} more" if len(faults) > 6 else ""
        raise ValueError(shown + more)


def inertia_matrix(inertia: tuple[float, ...]) -> Matrix:
    """Return the symmetric (3, 3) matrix of `xx yy zz xy xz yz`."""
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _unknown(kind: str, name: str, known: Collection[str], where: str) -> str:
    close = nearest_name(name, known)
    hint = f" Did you mean '{close}'?" if close else ""
    return f"{where} names {kind} '{name}', which does not exist.{hint}"


def _tree(robot: "RobotDescription") -> Iterator[str]:
    names = {link.name for link in robot.links}
    roots = [link.name for link in robot.links if link.parent is None]
    if len(roots) != 1:
        yield f"exactly one link has no parent, found {len(roots)}: {roots}"
    seen: set[str] = set()
    for link in robot.links:
        if link.parent is not None and link.parent not in names:
            yield _unknown("parent", link.parent, names, f"link '{link.name}'")
        elif link.parent is not None and link.parent not in seen:
            yield (
                f"link '{link.name}' stands before its parent '{link.parent}', or the "
                "two form a loop"
            )
        seen.add(link.name)
    if robot.links and robot.links[0].joint is not None:
        yield f"the first link '{robot.links[0].name}' has a joint; use [root] instead"


def _moving(robot: "RobotDescription") -> Iterator[str]:
    """Every set of links that moves as one rigid body needs mass and a tensor."""
    rigid = rigid_bodies(robot.links)
    masses = dict.fromkeys(rigid.values(), 0.0)
    turning: set[str] = set()
    for link in robot.links:
        masses[rigid[link.name]] += link.mass
        if any(link.inertia):
            turning.add(rigid[link.name])
    for link in robot.links:
        first = link is robot.links[0] and robot.root.kind != "fixed"
        if (first or link.joint is not None) and masses[link.name] == 0.0:
            yield f"link '{link.name}' moves and so needs a mass"
        elif (first or link.joint is not None) and link.name not in turning:
            yield f"link '{link.name}' moves and so needs an inertia"


def rigid_bodies(links: "tuple[Link, ...]") -> dict[str, str]:
    """Map each link to the moving (or first) link that it is rigidly fixed to."""
    owner: dict[str, str] = {}
    for link in links:
        fixed = link.joint is None and link.parent in owner
        owner[link.name] = owner[str(link.parent)] if fixed else link.name
    return owner


def _names(robot: "RobotDescription") -> Iterator[str]:
    owner: dict[str, str] = dict.fromkeys(RESERVED, "reserved name")
    items = [("link", link.name) for link in robot.links]
    items += [("joint", name) for name in robot.joint_names]
    items += [("frame", frame.name) for frame in robot.frames]
    for kind, name in items:
        if name in owner:
            yield f"{kind} '{name}' repeats the name of a {owner[name]}"
        owner.setdefault(name, kind)
    for kind, names in (
        ("camera", [c.name for c in robot.cameras]),
        ("sensor", [s.name for s in robot.sensors]),
        ("mount", [m.name for m in robot.mounts]),
    ):
        for name in sorted({n for n in names if names.count(n) > 1}):
            yield f"{kind} '{name}' is given twice"


def _link(link: "Link") -> Iterator[str]:
    where = f"link '{link.name}'"
    fault = unphysical(link)
    if fault is not None:
        yield f"{where}: {fault}"
        return
    for rule, text in implausible(link):
        if rule not in link.accept:
            yield f"{where}: {text}"


def unphysical(link: "Link") -> str | None:
    """Say what is wrong with an inertia that no body has; None when it is right."""
    if 0.0 < link.mass < SMALLEST_MASS:
        return f"a mass of {link.mass:.3g} kg is no mass; leave it out"
    point = link.joint is None and not any(link.inertia)
    if link.mass == 0.0 or point:
        return None  # a point mass is rigid with a body that has a tensor
    moments: Vector = np.linalg.eigvalsh(inertia_matrix(link.inertia))
    if moments[0] <= SMALLEST_MOMENT:
        return (
            f"the inertia {list(link.inertia)} is not positive definite (principal "
            f"moments {_numbers(moments)})"
        )
    if moments[2] > (moments[0] + moments[1]) * (1 + INERTIA_SLACK):
        return (
            f"the principal moments {_numbers(moments)} break the triangle inequality: "
            "no body has them"
        )
    return None


def _numbers(values: Vector) -> str:
    return "[" + ", ".join(f"{v:.4g}" for v in values) + "]"


def implausible(link: "Link") -> Iterator[tuple[Literal["com", "inertia"], str]]:
    """Compare centre of mass and inertia with the size of the link's shapes."""
    shapes = [*link.visual, *link.collision]
    if not shapes or link.mass == 0.0:
        return
    bounds = [shape_bounds(shape) for shape in shapes]
    low = np.min([b[0] for b in bounds], axis=0)
    high = np.max([b[1] for b in bounds], axis=0)
    slack = COM_SLACK * (high - low) + 0.005
    com = np.asarray(link.com)
    outside = float(np.max(np.maximum(low - slack - com, com - high - slack)))
    if outside > 0.0:
        yield (
            "com",
            f"the centre of mass {_numbers(com)} lies {outside * 1000:.0f} mm outside "
            f"the link's shapes, which span {_numbers(low)} to {_numbers(high)}",
        )
    half_diagonal = float(np.linalg.norm(high - low)) / 2
    trace = float(np.trace(inertia_matrix(link.inertia)))
    gyration = np.sqrt(trace / 2 / link.mass)
    lowest, highest = GYRATION_RANGE
    if not lowest <= gyration / half_diagonal <= highest:
        yield (
            "inertia",
            f"a radius of gyration of {gyration:.3g} m does not fit shapes of half "
            f"diagonal {half_diagonal:.3g} m",
        )


@kept_by_shape
def shape_bounds(shape: Shape) -> tuple[Vector, Vector]:
    """Compute the corners of an axis-aligned box around a shape, in the link frame.

    Read-only, as equal shapes share it.
    """
    low, high = _own_bounds(shape)
    if shape.quat != (1.0, 0.0, 0.0, 0.0):
        rotation = Rotation.from_quat(shape.quat, scalar_first=True).as_matrix()
        centre, reach = rotation @ (low + high) / 2, np.abs(rotation) @ (high - low) / 2
        low, high = centre - reach, centre + reach
    bounds = low + shape.pos, high + shape.pos
    for corner in bounds:
        corner.flags.writeable = False
    return bounds


def _own_bounds(shape: Shape) -> tuple[Vector, Vector]:
    """Compute the bounds in the shape's own frame: of spheres, or of discs."""
    from wbc_suite.robot.surfaces import support_points

    match shape:
        case Box(size=size) | Ellipsoid(size=size):
            return -np.asarray(size), np.asarray(size)
        case Sphere(radius=radius):
            centres, reach = np.zeros((1, 3)), np.array([[radius]])
        case Capsule(start=start, end=end, radius=radius):
            centres, reach = np.array([start, end]), np.array([[radius]])
        case Hull(spheres=spheres):
            rows = np.asarray(spheres, dtype=np.float64)
            centres, reach = rows[:, :3], rows[:, 3:]
        case Cylinder(start=start, end=end, radius=radius, radius_to=far):
            centres = np.array([start, end])
            axis = (centres[1] - centres[0]) / np.linalg.norm(centres[1] - centres[0])
            radii = np.array([[radius], [far or radius]])
            reach = radii * np.sqrt(np.maximum(0.0, 1.0 - axis**2))
        case _:
            centres, reach = support_points(shape), np.zeros((1, 1))
    return (centres - reach).min(axis=0), (centres + reach).max(axis=0)


def _references(robot: "RobotDescription") -> Iterator[str]:
    known = {
        "link": [link.name for link in robot.links],
        "frame": [frame.name for frame in robot.frames],
        "joint": list(robot.joint_names),
    }
    for where, kind, name in _references_made(robot):
        if name not in known[kind]:
            yield _unknown(kind, name, known[kind], where)
    yield from _colors(robot)


def _references_made(robot: "RobotDescription") -> Iterator[tuple[str, str, str]]:
    """List who names what: (where, kind, name)."""
    for item in (*robot.frames, *robot.mounts, *robot.cameras):
        yield f"{type(item).__name__.lower()} '{item.name}'", "link", item.link
    for sensor in robot.sensors:
        yield f"sensor '{sensor.name}'", "frame", sensor.frame
    for actuator in robot.actuators:
        yield "an actuator", "joint", actuator.joint
    for name in itertools.chain(*robot.contacts.exclude):
        yield "contacts.exclude", "link", name
    for name in itertools.chain(*((c.link, c.other) for c in robot.connects)):
        yield "a connect", "link", name
    for gripper, synergies in robot.synergies.items():
        for synergy in synergies:
            for joint in synergy.open:
                yield f"synergy '{synergy.name}' of '{gripper}'", "joint", joint


def _colors(robot: "RobotDescription") -> Iterator[str]:
    known = {*robot.materials, "grey"}
    for link in robot.links:
        for shape in link.visual:
            if isinstance(shape.color, str) and shape.color not in known:
                yield _unknown("material", shape.color, known, f"link '{link.name}'")
        for shape in link.collision:
            if shape.shape == "loft":
                yield (
                    f"link '{link.name}': a loft cannot collide, it need not be "
                    "convex; use a hull"
                )


def _mimics(robot: "RobotDescription") -> Iterator[str]:
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
            yield f"{where} is said to be held by a loop, but there is no [[connect]]"


def _keyframes(robot: "RobotDescription") -> Iterator[str]:
    joints = {joint.name: joint for joint in robot.joints}
    for name, values in robot.keyframes.items():
        for joint_name, value in values.items():
            joint = joints.get(joint_name)
            if joint is None:
                yield _unknown("joint", joint_name, joints, f"keyframe '{name}'")
            elif not _inside(value, joint):
                yield (
                    f"keyframe '{name}': {joint_name} = {value} is outside "
                    f"{list(joint.range or ())}"
                )


def _inside(value: float, joint: "Joint") -> bool:
    return joint.range is None or joint.range[0] <= value <= joint.range[1]


def _groups(robot: "RobotDescription") -> Iterator[str]:
    """Groups partition the joints that have a motor."""
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
        free = joint.passive or joint.mimic is not None
        if robot.groups and not free and joint.name not in owner:
            yield f"joint '{joint.name}' is in no group (or mark it passive)"
