"""Estimate masses and motors of robots whose files state few or none."""

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from wbc_suite.robot.elements import Frame, Link, rigid_bodies
from wbc_suite.robot.poses import se3_of
from wbc_suite.robot.shape_geometry import bounds_of, shape_bounds
from wbc_suite.typing import Matrix

DENSITY = 1000.0  # kg/m^3; what MuJoCo assumes
GRAVITY = 9.81  # m/s^2
RESERVE = 2.0
"""An estimated motor holds so many times the weight of what it moves."""
GYRATION = (0.03, 10.0)
"""Possible radius of gyration over the diagonal of the shapes; some may be missing. Of
1351 public files four have less on a moving link, all by mistake."""
LEAST_EFFORT = 1.0  # N m or N
LONG = 4  # joints; a limb of more is no pendulum, and its first joint has a motor
ROTOR = 2e-4
"""Estimated armature over effort, s^2: it is 1e-4 to 2e-4 for hips, knees and ankles of
Unitree's G1 and Go1 in the models of MuJoCo Menagerie."""


def estimate_masses(links: Sequence[Link]) -> list[Link]:
    """Return links with estimated masses if most of those that move have none.

    A link is a solid ellipsoid as large as the bounding box of its shapes.
    """
    rigid = rigid_bodies(links)
    heavy = {rigid[link.name] for link in links if link.mass > 0.0}
    moving = {link.name for link in links if link.joint is not None}
    if 2 * len(moving & heavy) >= len(moving):
        return list(links)
    empty = {x.name for x in links if rigid[x.name] not in heavy}
    solid = {x.name for x in links if x.collision or x.visual}
    return [ellipsoid(x) if x.name in empty & solid else x for x in links]


def ellipsoid(link: Link, mass: float | None = None) -> Link:
    """Return the link as a solid ellipsoid in the bounding box of its shapes.

    Without a mass in kg it has that of its volume. With one it keeps its centre.
    """
    low, high = bounds_of(link.collision or link.visual)
    com = tuple(((low + high) / 2.0).tolist()) if mass is None else link.com
    mass = mass or DENSITY * np.pi / 6.0 * float(np.prod(high - low))
    squares = ((high - low) / 2.0) ** 2
    moments = mass / 5.0 * (squares.sum() - squares)
    fields = {"mass": mass, "com": com, "inertia": (*moments.tolist(), 0.0, 0.0, 0.0)}
    return link.model_copy(update=fields)


def gyration_fault(link: Link) -> str | None:
    """Return what is wrong with an inertia that no body of such a size has, or None.

    Files have such tensors in other units, or as placeholders.
    """
    shapes = (*link.collision, *link.visual)
    if not shapes or link.mass == 0.0:
        return None
    low, high = bounds_of(shapes)
    size = float(np.linalg.norm(high - low))
    radius = float(np.sqrt(max(0.0, sum(link.inertia[:3])) / 2.0 / link.mass))
    if GYRATION[0] * size <= radius <= GYRATION[1] * size:
        return None
    return f"a radius of gyration of {radius:.3g} m is impossible in {size:.3g} m"


def estimate_motors(
    links: Sequence[Link],
    frames: Sequence[Frame],
    driven: Collection[str],
    limbs: Sequence[Sequence[str]] = (),
) -> list[Link]:
    """Return links with motors, and armatures, for joints without, if most have none.

    Most are those of the robot, or of one of the limbs, which are joints by name. The
    first joint of a long limb gets a motor, too.
    Joints that are `driven` have an actuator of another kind. The motor of a hinge
    holds twice the moment of the links behind it, as if these were stretched out
    horizontally; below the trunk of a robot with feet it holds half of the robot on its
    foot as well. That of a slide holds twice their weight.
    """
    own = [x.joint for x in links if x.joint is not None and x.joint.independent]
    bare = [x for x in own if x.effort is None and x.name not in driven]
    names = {joint.name for joint in bare}
    empty = [limb for limb in limbs if 2 * len(names.intersection(limb)) > len(limb)]
    if 2 * len(bare) <= len(own):
        lacking = {name for limb in empty for name in limb}
        lacking |= {limb[0] for limb in limbs if len(limb) > LONG}
        bare = [joint for joint in bare if joint.name in lacking]
    efforts = dict(_efforts(links, frames))
    changed: list[Link] = []
    for link in links:
        joint = link.joint
        if joint is not None and joint in bare:
            effort = efforts[joint.name]
            update = {"effort": effort, "armature": joint.armature or ROTOR * effort}
            joint = joint.model_copy(update=update)
        changed.append(link.model_copy(update={"joint": joint}))
    return changed


def estimate_lifts(links: Sequence[Link], driven: Collection[str]) -> list[Link]:
    """Return links with estimated motors for lifts too weak for their load.

    A lift is a slide without a hinge between it and the root: its load is the same in
    every posture, and a smaller effort is a placeholder, or a spindle locks it.
    """
    efforts = dict(_efforts(links, ()))
    turned: dict[str | None, Matrix] = {None: np.eye(3)}
    changed: list[Link] = []
    for link in links:
        joint, above = link.joint, turned.get(link.parent)
        if above is not None and (joint is None or joint.type == "slide"):
            turned[link.name] = R = above @ se3_of(link).rotation
            if joint is not None and joint.effort and joint.name not in driven:
                effort = float(abs((R @ joint.axis)[2])) * efforts[joint.name]
                if RESERVE * joint.effort < effort:
                    joint = joint.model_copy(update={"effort": round(effort, 2)})
        changed.append(link.model_copy(update={"joint": joint}))
    return changed


def estimate_armatures(links: Sequence[Link]) -> list[Link]:
    """Return links with armatures for motors whose file does not state them.

    URDF cannot state an armature.
    """
    return [
        with_rotor(link)
        if link.joint and "armature" not in link.joint.model_fields_set
        else link
        for link in links
    ]


def with_rotor(link: Link) -> Link:
    """Return a link whose motor has an estimated armature, if it has none."""
    joint = link.joint
    if joint is None or joint.armature or not joint.effort:
        return link
    update = {"armature": float(f"{ROTOR * joint.effort:.3g}")}
    return link.model_copy(update={"joint": joint.model_copy(update=update)})


def _reach(link: Link) -> float:
    """Return the distance of a link's outermost corner from its joint, m."""
    bounds = [shape_bounds(shape) for shape in (*link.collision, *link.visual)]
    return max((float(np.linalg.norm(x)) for pair in bounds for x in pair), default=0.0)


def _efforts(
    links: Sequence[Link], frames: Sequence[Frame]
) -> Iterator[tuple[str, float]]:
    """Yield the effort of each joint, N m or N, by name."""
    by_name = {link.name: link for link in links}
    half = sum(link.mass for link in links) / 2.0
    loads = [(link.name, link.mass, float(np.linalg.norm(link.com))) for link in links]
    loads += [
        (
            frame.link,
            half,
            max(_reach(by_name[frame.link]), float(np.linalg.norm(frame.pos))),
        )
        for frame in frames
        if frame.role == "foot"
    ]
    moments: dict[str, float] = {}
    weights: dict[str, float] = {}
    for name, mass, offset in loads:
        link: Link | None = by_name[name]
        arm = offset
        while link is not None:
            moments[link.name] = moments.get(link.name, 0.0) + GRAVITY * mass * arm
            weights[link.name] = weights.get(link.name, 0.0) + GRAVITY * mass
            arm += float(np.linalg.norm(link.pos))
            link = by_name.get(str(link.parent))
    for link in links:
        if link.joint is not None:
            held = (moments if link.joint.type == "hinge" else weights)[link.name]
            yield link.joint.name, round(max(RESERVE * held, LEAST_EFFORT), 2)
