"""Estimate masses and motors of robots whose files state few or none."""

import importlib
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np

from wbc_suite.robot.elements import Frame, Link, rigid_bodies
from wbc_suite.robot.inertia import inertia_fields
from wbc_suite.robot.mjcf_export_geoms import triangles_of
from wbc_suite.robot.poses import poses_in_rigid_bodies, se3_of
from wbc_suite.robot.shape_geometry import bounds_of, shape_bounds
from wbc_suite.robot.triangle_meshes import merge
from wbc_suite.typing import Matrix

DENSITY = 1000.0  # kg/m^3; what MuJoCo assumes
GRAVITY = 9.81  # m/s^2
RESERVE = 2.0
"""An estimated motor holds so many times the weight of what it moves."""
GYRATION = (0.03, 10.0)
"""Possible radius of gyration over the diagonal of the shapes; some may be missing. Of
1351 public files four have less on a moving link, all by mistake."""
STRETCHED, LEAST = 0.5, 0.3
"""Part of an outstretched limb's weight that its motor holds, and least density over
`DENSITY`. Of 24 public robots whose masses were left out, 20 are estimated to within a
factor of 2."""
HEAVIEST_BASE = 2.0
"""Greatest mass of what carries all others over theirs; 0.04 to 2.4 in these robots."""
LEAST_EFFORT = 1.0  # N m or N
LONG = 4  # joints; a limb of more is no pendulum, and its first joint has a motor
ROTOR = 2e-4
"""Estimated armature over effort, s^2: it is 1e-4 to 2e-4 for hips, knees and ankles of
Unitree's G1 and Go1 in the models of MuJoCo Menagerie."""


def estimate_masses(links: Sequence[Link], frames: Sequence[Frame]) -> list[Link]:
    """Return links with estimated masses if most of those that move have none.

    A link is a solid of its shapes, those that are drawn if there are any in its rigid
    body, which has at most the volume of its convex hull. The density is `DENSITY`, or
    less if the motors of the most loaded joints could not hold `STRETCHED` of their
    outstretched limbs, and of half of the robot on its feet. What carries all others
    weighs at most `HEAVIEST_BASE` of them.
    """
    rigid = rigid_bodies(links)
    heavy = {rigid[link.name] for link in links if link.mass > 0.0}
    moving = {link.name for link in links if link.joint is not None}
    if 2 * len(moving & heavy) >= len(moving):
        return list(links)
    drawn = {rigid[x.name] for x in links if x.visual}
    empty = {
        x.name
        for x in links
        if rigid[x.name] not in heavy
        and (x.visual if rigid[x.name] in drawn else x.collision)
    }
    shares = _hull_shares([x for x in links if x.name in empty], links)
    solids = [
        _scaled(_solid(x), shares[rigid[x.name]]) if x.name in empty else x
        for x in links
    ]
    density = _held_share(solids, frames)
    filled = [_scaled(x, density) if x.name in empty else x for x in solids]
    base = [x for x in filled if rigid[x.name] == links[0].name]
    below, all_ = (sum(x.mass for x in own) for own in (base, filled))
    share = min(1.0, HEAVIEST_BASE * (all_ - below) / below) if below else 1.0
    lighter = {x.name for x in base} & empty
    return [_scaled(x, share) if x.name in lighter else x for x in filled]


def _mesh(link: Link) -> Any:
    """Return trimesh's mesh of all shapes of a link."""
    mesh = merge([triangles_of(shape) for shape in link.visual or link.collision])
    trimesh: Any = importlib.import_module("trimesh")  # 0.3 s, and without types
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def _solid(link: Link) -> Link:
    """Return a link as a solid of its shapes."""
    own = _mesh(link).mass_properties
    fields = {
        "mass": DENSITY * float(own.mass),
        "com": tuple(own.center_mass.tolist()),
        "inertia": inertia_fields(DENSITY * own.inertia),
    }
    return link.model_copy(update=fields)


def _hull_shares(solids: Sequence[Link], links: Sequence[Link]) -> dict[str, float]:
    """Return the volume of each rigid body's hull over that of its links, at most 1."""
    rigid, poses = rigid_bodies(links), poses_in_rigid_bodies(links)
    parts: dict[str, list[Any]] = {}
    for link in solids:
        mesh = _mesh(link).apply_transform(poses[link.name].homogeneous)
        parts.setdefault(rigid[link.name], []).append(mesh)
    shares: dict[str, float] = {}
    for name, meshes in parts.items():
        points = np.concatenate([mesh.vertices for mesh in meshes])
        trimesh: Any = importlib.import_module("trimesh")
        hull = float(trimesh.convex.convex_hull(points).volume)
        shares[name] = min(1.0, hull / sum(float(mesh.volume) for mesh in meshes))
    return shares


def _scaled(link: Link, factor: float) -> Link:
    """Return a link with its mass times a factor."""
    inertia = tuple(factor * x for x in link.inertia)
    return link.model_copy(update={"mass": factor * link.mass, "inertia": inertia})


def _held_share(links: Sequence[Link], frames: Sequence[Frame]) -> float:
    """Return which part of their masses the motors of links hold, `LEAST` to 1."""
    loads = dict(_efforts(links, frames))
    own = [x.joint for x in links if x.joint is not None and x.joint.independent]
    stated = [(loads[x.name] / RESERVE, x.effort) for x in own if x.effort]
    most = sorted(stated, reverse=True)[: max(1, len(stated) // 3)]
    held = [effort / (STRETCHED * load) for load, effort in most]
    return float(np.clip(np.median(held), LEAST, 1.0)) if held else 1.0


def ellipsoid(link: Link) -> Link:
    """Return a link with the inertia of an ellipsoid in the box around its shapes.

    It keeps its mass and centre of mass.
    """
    low, high = bounds_of(link.collision or link.visual)
    squares = ((high - low) / 2.0) ** 2
    moments = link.mass / 5.0 * (squares.sum() - squares)
    return link.model_copy(update={"inertia": (*moments.tolist(), 0.0, 0.0, 0.0)})


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
