"""Estimate masses and motors of robots whose files state none."""

from collections.abc import Iterator, Sequence

import numpy as np

from wbc_suite.robot.elements import Frame, Link
from wbc_suite.robot.shape_geometry import shape_bounds
from wbc_suite.typing import Vector

DENSITY = 1000.0  # kg/m^3; what MuJoCo assumes
GRAVITY = 9.81  # m/s^2
RESERVE = 2.0
"""An estimated motor holds so many times the weight of what it moves."""
LEAST_EFFORT = 1.0  # N m or N
ROTOR = 2e-4
"""Estimated armature over effort, s^2: it is 1e-4 to 2e-4 for hips, knees and ankles of
Unitree's G1 and Go1 in the models of MuJoCo Menagerie."""


def estimate_masses(links: Sequence[Link]) -> list[Link]:
    """Return links with estimated masses if none of those that have shapes has a mass.

    A link is a solid ellipsoid as large as the bounding box of its shapes.
    """
    if any(link.mass > 0.0 for link in links):
        return list(links)
    return [_filled(x) if x.collision or x.visual else x for x in links]


def _filled(link: Link) -> Link:
    bounds = np.array([shape_bounds(shape) for shape in link.collision or link.visual])
    low: Vector = bounds[:, 0].min(axis=0)
    high: Vector = bounds[:, 1].max(axis=0)
    mass = DENSITY * np.pi / 6.0 * float(np.prod(high - low))
    squares = ((high - low) / 2.0) ** 2
    moments = mass / 5.0 * (squares.sum() - squares)
    fields = {
        "mass": mass,
        "com": tuple(((low + high) / 2.0).tolist()),
        "inertia": (*moments.tolist(), 0.0, 0.0, 0.0),
    }
    return link.model_copy(update=fields)


def estimate_motors(links: Sequence[Link], frames: Sequence[Frame]) -> list[Link]:
    """Return links with estimated motors, and armatures where there are none.

    The motor of a hinge holds twice the moment of the links behind it, as if these were
    stretched out horizontally; below the trunk of a robot with feet it holds half of
    the robot on its foot as well. That of a slide holds twice their weight.
    """
    efforts = dict(_efforts(links, frames))
    changed: list[Link] = []
    for link in links:
        joint = link.joint
        if joint is not None and joint.independent:
            effort = efforts[joint.name]
            armature = joint.armature or ROTOR * effort
            update = {"effort": effort, "armature": armature}
            joint = joint.model_copy(update=update)
        changed.append(link.model_copy(update={"joint": joint}))
    return changed


def _efforts(
    links: Sequence[Link], frames: Sequence[Frame]
) -> Iterator[tuple[str, float]]:
    """Yield the effort of each joint, N m or N, by name."""
    by_name = {link.name: link for link in links}
    half = sum(link.mass for link in links) / 2.0
    loads = [(link.name, link.mass, float(np.linalg.norm(link.com))) for link in links]
    loads += [(frame.link, half, 0.0) for frame in frames if frame.role == "foot"]
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
