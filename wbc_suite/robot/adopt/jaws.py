"""Find one moving jaw that closes on what carries it."""

from collections.abc import Collection, Sequence

import numpy as np
import pinocchio as pin

from wbc_suite.robot.elements import Link, rigid_bodies
from wbc_suite.robot.poses import rotation_matrix, se3_of
from wbc_suite.robot.shape_geometry import hull_spheres
from wbc_suite.robot.shapes import Shape
from wbc_suite.typing import Matrix, Vector

TIP = 0.01  # m; points of a finger that are so near to its farthest one are its tip
NEAR, WIDE = 0.02, 0.02
"""Largest gap of a closed jaw, and least further opening, m."""
ALONG = 0.5  # least length of the fixed jaw over that of the moving one
TURNS = 73  # postures that are compared; 5 degrees of a full turn
WRIST, FINGER = 2, 0.25
"""Most joints before a palm, and greatest length of a finger, m. The Shadow
hand has 2 joints and 0.15 m; an arm has more."""
MORE = 400  # points between the corners of each shape
OPENING = 1.6  # rad from closed to open of a jaw whose file states no limits


def closes_on_parent(links: Sequence[Link], name: str) -> bool:
    """Whether a link and the body that carries it are two jaws.

    Its tip comes within 20 mm of a point of the body at one end of its range, and is 20
    mm farther away at the other. This point lies beyond the joint, seen from the joint
    that moves the body, and at least half as far from the joint as the tip: a forearm,
    on which a hand can fold, lies behind.
    """
    link = next(x for x in links if x.name == name)
    palm = rigid_bodies(links)[str(link.parent)]
    body, jaw = points_on(links, palm), points_on(links, name)
    if link.joint is None or not len(body) or not len(jaw):
        return False
    tip = jaw_tip(jaw)
    low, high = link.joint.range or (-np.pi, np.pi)
    values = np.linspace(low, high, TURNS)
    start, turned = _fixed_pose(links, name), np.asarray(link.joint.axis)
    hinge = start.translation
    tips = np.array([_moved(start, link, turned, x).act(tip) for x in values])
    away = np.linalg.norm(tips[:, None] - body, axis=2)
    gaps, contact = away.min(axis=1), body[away[away.min(axis=1).argmin()].argmin()]
    least = int(gaps.argmin())
    at_end = link.joint.range is None or min(least, TURNS - 1 - least) < TURNS // 3
    lever = float(np.linalg.norm(contact - hinge))
    return (
        at_end
        and gaps[least] < NEAR
        and max(gaps[0], gaps[-1], gaps[TURNS // 2]) > gaps[least] + WIDE
        and float(np.linalg.norm(contact)) > float(np.linalg.norm(hinge))
        and lever > ALONG * float(np.linalg.norm(tip))
    )


def is_hand(links: Sequence[Link], kinds: Collection[str]) -> bool:
    """Whether all moving links are the fingers of one hand, with a wrist or without.

    Two fingers or more hang on one palm, behind two joints at most, and none reaches
    farther than 25 cm; or it is one jaw. Legs, wheels and heads, by their names,
    joints without limits, and links without shapes are no fingers.
    """
    rigid = rigid_bodies(links)
    moving = [link for link in links if link.joint is not None]
    above = {link.name: rigid[str(link.parent)] for link in moving}
    tops = [link.name for link in moving if above[link.name] not in above]
    wrist = 0
    while len(tops) == 1 and (below := [n for n, x in above.items() if x == tops[0]]):
        tops, wrist = below, wrist + 1
    free = any(x.joint and x.joint.independent and not x.joint.range for x in moving)
    if {"leg", "base", "head", "torso"} & set(kinds) or wrist > WRIST or not tops:
        return False
    if len(tops) == 1:
        return wrist == 0 and closes_on_parent(links, tops[0])
    reach: dict[str, float] = {}
    for link in moving:
        start = reach.get(above[link.name], 0.0)
        step = float(np.linalg.norm(_fixed_pose(links, link.name).translation))
        inside = link.name in tops or above[link.name] in reach
        if inside:
            reach[link.name] = start + (0.0 if link.name in tops else step)
    ends = [
        length + float(np.linalg.norm(points_on(links, name), axis=1).max(initial=0.0))
        for name, length in reach.items()
    ]
    return not free and 0.0 < max(ends) < FINGER


def jaw_tip(points: Matrix, origin: Vector | float = 0.0) -> Vector:
    """Return the mean of the points that are farthest from the origin, shape (3,)."""
    away = np.linalg.norm(points - origin, axis=1)
    return points[away > away.max() - TIP].mean(axis=0)


def points_on(links: Sequence[Link], body: str) -> Matrix:
    """Return points on a link and those fixed to it, shape (n, 3), in its frame."""
    rigid = rigid_bodies(links)
    parts = [np.empty((0, 3))]
    for link in links:
        if rigid[link.name] == body and (link.collision or link.visual):
            pose = _fixed_pose(links, link.name, body)
            points = _surface_points(link.collision or link.visual)
            parts.append(points @ pose.rotation.T + pose.translation)
    return np.concatenate(parts)


def _surface_points(shapes: Sequence[Shape]) -> Matrix:
    """Return the corners of convex shapes and points between, (n, 3), in their link.

    Spheres count as their centres.
    """
    parts: list[Matrix] = []
    rng = np.random.default_rng(0)
    for shape in shapes:
        corners = hull_spheres(shape)[:, :3]
        shares = rng.dirichlet(np.full(3, 0.7), size=MORE)
        chosen = corners[rng.integers(len(corners), size=(MORE, 3))]
        between = np.einsum("nk,nki->ni", shares, chosen)
        own = np.concatenate([corners, between])
        parts.append(own @ rotation_matrix(shape).T + shape.pos)
    return np.concatenate(parts)


def _fixed_pose(links: Sequence[Link], name: str, body: str | None = None) -> pin.SE3:
    """Return the pose of a link in a body, by default in that which carries it."""
    by_name, rigid = {link.name: link for link in links}, rigid_bodies(links)
    if name == body:
        return pin.SE3.Identity()
    link = by_name[name]
    body = body or rigid[str(link.parent)]
    pose = se3_of(link)
    while link.parent != body:
        link = by_name[str(link.parent)]
        pose = se3_of(link) * pose
    return pose


def _moved(start: pin.SE3, link: Link, axis: Vector, value: float) -> pin.SE3:
    if link.joint is not None and link.joint.type == "slide":
        return start * pin.SE3(np.eye(3), axis * value)
    return start * pin.SE3(pin.exp3(axis * value), np.zeros(3))
