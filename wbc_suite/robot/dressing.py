"""Draw a robot with the meshes of another description of the same robot.

The two need not share names, link frames, or the zeros of joints. Joints are matched by
their axes in space at zero. Of the transforms between the two descriptions that two
pairs of axes, a pair of links, or roots with one origin define, that one is taken under
which most joints match.
"""

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from typing import Any, TypeAlias

import numpy as np
import pinocchio as pin

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Link
from wbc_suite.robot.mjcf_export_geoms import rgba_of
from wbc_suite.robot.poses import joint_motion, pose_fields, se3_of
from wbc_suite.robot.shape_geometry import shape_bounds
from wbc_suite.robot.shapes import Drawn, Shape, SkinMesh
from wbc_suite.robot.surfaces import skin_triangles
from wbc_suite.typing import Matrix, Vector

FAR = 0.008  # most distance between matched axes, m; vendors' own files differ by 5 mm
TURN = 0.05  # most angle between matched axes, rad
MAX_HYPOTHESES = 20_000
"""Most transforms that are tried; two humanoids of 43 joints have 9,000."""
ACROSS = 0.02  # least length, 1 or m, of what shows how a joint is turned
SAMPLES = 500  # most points of a surface that are compared
BEST = 40  # transforms under which the trees of joints are compared
SKIP = 3  # most joints of the other robot that ours lacks, one below the other

QUARTER_TURNS = [
    np.array(R)
    for R in itertools.product(*[np.vstack([np.eye(3), -np.eye(3)])] * 3)
    if np.isclose(np.linalg.det(np.array(R)), 1.0)
]
"""The 24 rotations between frames along the same axes."""


@dataclass(eq=False, slots=True)
class _Body:
    """Links that are fixed to each other, with the joint that carries them.

    Attributes:
        links: The links and their poses in the robot's frame, at zero.
        above: The body that carries this one.
        type: Type of the joint; empty for the root.
        point: A point of the joint's axis in the robot's frame, m.
        axis: Direction of the axis in the robot's frame.
    """

    links: list[tuple[Link, Any]]
    above: "_Body | None" = None
    type: str = ""
    point: Vector = field(default_factory=lambda: np.zeros(3))
    axis: Vector = field(default_factory=lambda: np.zeros(3))
    below: "list[_Body]" = field(default_factory=list["_Body"])


_Match: TypeAlias = tuple[_Body, list[_Body], Any]
"""A body, those of the other robot that move with it, and the transform to ours."""


def dress(
    robot: RobotDescription, other: RobotDescription, without: Iterable[str] = ()
) -> dict[str, tuple[Drawn, ...]]:
    """Return what another description draws for the links of a robot, by link.

    Links of the robot that no joint of the other moves keep their shapes. Those that
    the first of several fixed links is drawn for have nothing to draw.

    Args:
        robot: The robot.
        other: The other description of it, or of a part of it.
        without: Names of the other's links that are not drawn.
    """
    skipped, drawn = set(without), dict[str, tuple[Drawn, ...]]()
    for own, others, T in _best(_bodies(robot), _bodies(other), other):
        (first, pose), *rest = own.links
        shapes = [
            _placed(shape, other, pose.inverse() * T * place)
            for body in others
            for link, place in body.links
            if link.name not in skipped
            for shape in other.drawn(link)
        ]
        if any(shape.shape == "skin" for shape in shapes):
            drawn |= {link.name: () for link, _ in rest}
            drawn[first.name] = tuple(shapes)
    return drawn


def _placed(shape: Drawn, other: RobotDescription, T: Any) -> Drawn:
    """Return a shape of the other robot's moved, in its own colour."""
    color = rgba_of(other, shape)
    return shape.model_copy(update=pose_fields(T * se3_of(shape)) | {"color": color})


def _bodies(robot: RobotDescription) -> list[_Body]:
    """Return the bodies of a robot at zero, from the root."""
    poses: dict[str, Any] = {}
    owner: dict[str, _Body] = {}
    bodies: list[_Body] = []
    for link in robot.links:
        pose = se3_of(link)
        if link.parent is not None:
            pose = poses[link.parent] * pose
        poses[link.name] = pose
        if link.parent is not None and link.joint is None:
            owner[link.name] = owner[link.parent]
            owner[link.name].links.append((link, pose))
            continue
        above = owner.get(link.parent or "")
        body = owner[link.name] = _Body([(link, pose)], above)
        if link.joint is not None:
            body.type = link.joint.type
            body.point = pose.translation
            body.axis = pose.rotation @ np.asarray(link.joint.axis)
        if above is not None:
            above.below.append(body)
        bodies.append(body)
    return bodies


def _best(
    ours: list[_Body], theirs: list[_Body], other: RobotDescription
) -> list[_Match]:
    """Return the matched bodies under the transform that matches most of them.

    Robots are symmetric: of equal ones that counts under which drawings agree best.
    """
    found: dict[tuple[float, ...], tuple[int, Any]] = {}
    for T in itertools.islice(_hypotheses(ours, theirs), MAX_HYPOTHESES):
        entries: Matrix = T.homogeneous
        key = tuple(np.round(entries, 2).ravel().tolist())
        if key not in found:
            found[key] = _count(ours[1:], theirs[1:], T), T
    ranked = sorted(found.values(), key=lambda item: (-item[0], _angle(item[1])))
    trees = [
        _matched(ours[0], start, T)
        for _, T in ranked[:BEST]
        for start in theirs  # ours may be a part of the other
    ]
    most = min(map(_rank, trees))
    equal = [tree for tree in trees if _rank(tree) == most]
    clouds = {body: _points(body, other) for body in theirs}
    return min(equal, key=lambda tree: _differences(tree, clouds))


def _rank(tree: list[_Match]) -> tuple[int, int]:
    """Return what is worse the larger it is, the first number before the second."""
    return -len(tree), sum(len(others) - 1 for _, others, _ in tree)


def _points(body: _Body, robot: RobotDescription) -> Matrix:
    """Return points of what is drawn for a body, shape (n, 3), in its robot's frame."""
    found = [np.zeros((0, 3))]
    for link, place in body.links:
        for shape in robot.drawn(link):
            if isinstance(shape, SkinMesh):
                own, pose = skin_triangles(shape)[0], place * se3_of(shape)
                own = own[:: max(1, len(own) // SAMPLES)]
            else:
                own, pose = _corners(shape), place
            found.append(own @ pose.rotation.T + pose.translation)
    return np.concatenate(found)


def _corners(shape: Shape) -> Matrix:
    """Return the corners of the box around a shape, shape (8, 3), in the link."""
    return np.array(list(itertools.product(*np.stack(shape_bounds(shape)).T)))


def _differences(tree: list[_Match], clouds: dict[_Body, Matrix]) -> float:
    """Return by how much the boxes around matched bodies differ in all, m."""
    total = 0.0
    for own, others, T in tree:
        corners = [
            _corners(shape) @ place.rotation.T + place.translation
            for link, place in own.links
            for shape in link.visual
        ]
        points = np.concatenate([clouds[body] for body in others])
        if corners and len(points):
            points = points @ T.rotation.T + T.translation
            for extreme in (np.min, np.max):
                gap = extreme(points, axis=0) - extreme(np.concatenate(corners), axis=0)
                total += float(np.linalg.norm(gap))
    return total


def _angle(T: Any) -> float:
    return float(np.linalg.norm(pin.log3(T.rotation)))


def _count(ours: list[_Body], theirs: list[_Body], T: Any) -> int:
    """Return how many axes lie on one of the other robot's."""
    if not ours or not theirs:
        return 0
    p, a = (np.array([getattr(b, key) for b in ours]) for key in ("point", "axis"))
    q, b = (np.array([getattr(b, key) for b in theirs]) for key in ("point", "axis"))
    q, b = q @ T.rotation.T + T.translation, b @ T.rotation.T
    turned = np.linalg.norm(np.cross(a[:, None], b[None]), axis=-1) < TURN
    apart = np.cross(q[None] - p[:, None], a[:, None])
    near = turned & (np.linalg.norm(apart, axis=-1) < FAR)
    return min(int(near.any(axis=0).sum()), int(near.any(axis=1).sum()))


def _matched(own: _Body, other: _Body, T: Any) -> list[_Match]:
    """Return the matched bodies of two trees, from these two on."""
    bodies, found = [other], list[_Match]()
    candidates = list(_descendants(other))
    for turned in _turns(own, other, T):
        taken: set[_Body] = set()
        for child in own.below:
            near = [
                (len(between), -_alike(child, body), k)
                for k, (body, between) in enumerate(candidates)
                if body not in taken and _is_on(child, body, turned)
            ]
            if near:
                body, between = candidates[min(near)[-1]]
                taken |= {body, *between}
                bodies += [b for b in between if b not in bodies]
                found += _matched(child, body, turned)
        if found:
            return [(own, bodies, turned), *found]
    return [(own, bodies, T)]


def _descendants(
    body: _Body, between: tuple[_Body, ...] = ()
) -> Iterator[tuple[_Body, tuple[_Body, ...]]]:
    """Yield the bodies below one, and those between."""
    for child in body.below:
        yield child, between
        if len(between) < SKIP:
            yield from _descendants(child, (*between, child))


def _is_on(own: _Body, other: _Body, T: Any) -> bool:
    """Whether two joints move alike: slides along, hinges about one axis."""
    axis = T.rotation @ other.axis
    if own.type != other.type or np.linalg.norm(np.cross(axis, own.axis)) > TURN:
        return False
    return own.type == "slide" or _apart(own, other, T) < FAR


def _apart(own: _Body, other: _Body, T: Any) -> float:
    """Return the distance between two parallel axes, m, to 1 mm."""
    across = np.cross(T * other.point - own.point, own.axis)
    return round(float(np.linalg.norm(across)), 3)


def _alike(own: _Body, other: _Body) -> float:
    """Return how alike the names of two bodies' links are, from 0 to 1."""
    names = (body.links[0][0].name.casefold() for body in (own, other))
    return SequenceMatcher(None, *names, autojunk=False).ratio()


def _turns(own: _Body, other: _Body, T: Any) -> Iterator[Any]:
    """Yield a transform, and those with other zeros of the joint that carries both."""
    yield T
    if own.type != "hinge":
        return
    for child, (body, _) in itertools.product(own.below, _descendants(other)):
        one = _across(own, child.point, child.axis)
        two = _across(own, T * body.point, T.rotation @ body.axis)
        if one is None or two is None:
            continue
        turn = float(np.arctan2(own.axis @ np.cross(two, one), two @ one))
        back = pin.SE3(np.eye(3), own.point)
        for angle in (turn, turn + np.pi):  # an axis may point either way
            motion = joint_motion(own.axis, angle, slide=False)
            yield back * motion * back.inverse() * T


def _across(own: _Body, point: Vector, axis: Vector) -> Vector | None:
    """Return a vector across a joint's axis that another axis turns with; or None."""
    for vector in (axis, point - own.point):
        flat = vector - own.axis * float(own.axis @ vector)
        if float(np.linalg.norm(flat)) > ACROSS:
            return flat
    return None


def _hypotheses(ours: list[_Body], theirs: list[_Body]) -> Iterator[Any]:
    """Yield transforms from the frame of the other robot to ours."""
    yield pin.SE3.Identity()
    placed = {link.name.casefold(): T for body in ours for link, T in body.links}
    for body in theirs:
        for link, T in body.links:
            if link.name.casefold() in placed:
                yield placed[link.name.casefold()] * T.inverse()
    yield from (pin.SE3(R, np.zeros(3)) for R in QUARTER_TURNS)
    first = [frame for body in ours for frame in _axis_frames(body, both=False)]
    other = [frame for body in theirs for frame in _axis_frames(body, both=True)]
    for own, their in itertools.product(first, other):
        if np.allclose(own[0], their[0], atol=FAR) and own[1] == their[1]:
            yield own[2] * their[2].inverse()


def _axis_frames(
    body: _Body, *, both: bool
) -> Iterator[tuple[Vector, tuple[str, str], Any]]:
    """Yield frames on the axis of a body and that of a body below, not parallel to it.

    Each has the distance of the axes in m, the cosine and the sine of their angle, and
    the types of joints. An axis may point either way, `both` are yielded.
    """
    signs = (1.0, -1.0) if both else (1.0,)
    for child, u, v in itertools.product(body.below, signs, signs):
        a, b = u * body.axis, v * child.axis
        normal = np.cross(a, b)
        sine = float(np.linalg.norm(normal))
        if sine < 0.1 or not body.type:
            continue
        normal /= sine
        gap = child.point - body.point
        along = float(np.cross(gap, b) @ normal) / sine
        R = np.column_stack([normal, np.cross(a, normal), a])
        measures = np.array([gap @ normal, a @ b, sine])
        yield measures, (body.type, child.type), pin.SE3(R, body.point + along * a)
