"""Keep links above the floor, and out of things that do not move."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_count, check_number
from wbc_suite.compiling import inner, record_type
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays
from wbc_suite.qp.limit import LimitKind, RowLimit
from wbc_suite.qp.part import joined, place_point
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.qp.self_collision_limit import LinkPair
from wbc_suite.qp.self_collision_rows import (
    ROW,
    greatest_approach,
    insert_nearest,
    write_approach,
)
from wbc_suite.typing import CompiledRecords, Matrix, Vector

FLOOR = record_type(
    ("spheres", "i8"),  # n
    ("height", "f8"),
    ("margin", "f8"),
    ("influence", "f8"),
    ("rate", "f8"),
    ("braking", "f8"),
)
"""Of a floor limit, see `FloorLimit`."""

SPHERE = record_type(
    ("joint", "i8"),
    ("centre", "f8", (3,)),  # in the joint, m
    ("radius", "f8"),  # m
)

OBSTACLES = record_type(("pairs", "i8"), ("rate", "f8"), ("braking", "f8"))
"""Of an obstacle limit, see `ObstacleLimit`."""

OBSTACLE_PAIR = record_type(
    ("joint", "i8"),  # that moves the link
    ("margin", "f8"),  # distance that is kept, m
)

PLANE = record_type(
    ("found", "i8"),  # pair of the row, -1 for none
    ("point", "f8", (3,)),  # nearest point of the link, in its joint, m
    ("normal", "f8", (3,)),  # of a plane that touches the obstacle, towards the link
    ("offset", "f8"),  # of the plane, m
    ("distance", "f8"),  # output: distance of the point from the plane, m
)

_FLOOR, _SPHERE, _OBSTACLES, _PAIR = (
    x.itemsize // 8 for x in (FLOOR, SPHERE, OBSTACLES, OBSTACLE_PAIR)
)


@inner
def floor_rows(
    robot: RobotArrays, own: Vector, dt: float, rows: Matrix, values: Vector
) -> None:
    """Write the rows of the lowest spheres.

    Own are `FLOOR`, n `SPHERE` and k `ROW` records. Rows get the negative derivative of
    the height of each; values get how far it may come down in dt seconds, m.
    """
    floor = own[:_FLOOR].view(FLOOR)[0]
    last = _FLOOR + _SPHERE * floor.spheres
    spheres: CompiledRecords = own[_FLOOR:last].view(SPHERE)
    places = own[last:].view(ROW)
    found, distance, count = places["found"], places["distance"], 0
    x, up, poses = np.empty(3), np.zeros(3), robot.pose
    up[2] = 1.0
    for row in range(values.shape[0]):
        found[row], distance[row] = -1, np.inf
    for k in range(spheres.shape[0]):
        sphere = spheres[k]
        place_point(poses[sphere.joint], sphere.centre, x)
        d = x[2] - sphere.radius - floor.height
        if d < min(floor.influence, distance[-1]):
            insert_nearest(found, distance, count, k, d)
            count += 1
    for row in range(values.shape[0]):
        left, k = distance[row] - floor.margin, found[row]
        values[row] = greatest_approach(left, floor.rate, floor.braking, dt)
        if k >= 0:
            place_point(poses[spheres[k].joint], spheres[k].centre, x)
        write_point_row(robot, spheres[k].joint if k >= 0 else 0, x, up, rows[row])


@inner
def obstacle_rows(
    robot: RobotArrays, own: Vector, dt: float, rows: Matrix, values: Vector
) -> None:
    """Write the rows of all points.

    Own are `OBSTACLES`, p `OBSTACLE_PAIR` and k `PLANE` records. Rows get the negative
    derivative of each distance; values get how far a point may come nearer in dt
    seconds, m.
    """
    settings = own[:_OBSTACLES].view(OBSTACLES)[0]
    end = _OBSTACLES + _PAIR * settings.pairs
    pairs, places, x = (
        own[_OBSTACLES:end].view(OBSTACLE_PAIR),
        own[end:].view(PLANE),
        np.empty(3),
    )
    for row in range(values.shape[0]):
        place, n = places[row], places[row].normal
        values[row], place.distance, joint = UNBOUNDED, np.inf, 0
        if place.found >= 0:
            pair: CompiledRecords = pairs[place.found]
            joint = pair.joint
            place_point(robot.pose[joint], place.point, x)
            place.distance = n[0] * x[0] + n[1] * x[1] + n[2] * x[2] - place.offset
            left = place.distance - pair.margin
            values[row] = greatest_approach(left, settings.rate, settings.braking, dt)
        write_point_row(robot, joint, x, n, rows[row])


@inner
def write_point_row(
    robot: RobotArrays, joint: int, x: Vector, n: Vector, out: Vector
) -> None:
    """Write the negative speed of a point x of a joint along n; of joint 0 it is 0."""
    for col in range(out.shape[0]):
        out[col] = 0.0
    while joint > 0:
        write_approach(robot, joint, x, n, -1.0, out)
        joint = robot.joints[joint].parent


class FloorLimit(RowLimit):
    """Slow what comes down, and never let it touch the floor.

    Shapes are convex hulls of spheres, so that the lowest sphere gives their distance
    from a level plane exactly. For the lowest ones, with d the height above the margin,

        z' >= -min(rate d, sqrt(2 braking d)),

    and where d is negative, upwards at no more than 0.2 m/s.

    Args:
        spheres: Rows x, y, z, radius (m) in the frame of each link, shape (n, 4).
        height: Height of the floor in the world, m.
        margin: Distance that is kept, m.
        nearest: Number of rows: how many spheres a tick considers.
        influence: Spheres higher than this are left out, m.
        rate: Speed per distance left, 1/s.
        braking: Deceleration, m/s^2.

    Attributes:
        found: Sphere of each row of the last tick, lowest first; -1 for none.
        distances: Distance of each row's sphere from the floor, m; inf for none.

    Raises:
        ConfigError: If a number is out of range.
    """

    kernel: ClassVar[Any] = floor_rows
    kind = LimitKind.FLOOR

    def __init__(
        self,
        spheres: Mapping[str, Matrix],
        *,
        height: float = 0.0,
        margin: float = 0.005,
        nearest: int = 20,
        influence: float = 0.5,
        rate: float = 10.0,
        braking: float = 4.0,
    ) -> None:
        name = "FloorLimit"
        self.dim = check_count(f"{name}: nearest", nearest, least=1)
        self.height = check_number(f"{name}: height", height)
        self.margin = check_number(f"{name}: margin", margin, least=0.0)
        what = f"{name}: influence, more than the margin,"
        self.influence = check_number(what, influence, above=self.margin)
        self.rate = check_number(f"{name}: rate", rate, above=0.0)
        self.braking = check_number(f"{name}: braking", braking, above=0.0)
        self._links = [link for link, rows in spheres.items() for _ in rows]
        self._spheres = np.concatenate([np.zeros((0, 4)), *spheres.values()])
        self._model: pin.Model | None = None  # that the numbers belong to

    def bind(self, configuration: Configuration) -> None:
        """Resolve links to joints; UnknownNameError if one is no frame of the model."""
        model, count = configuration.model, len(self._links)
        if self._model is model:
            return
        self._own, views = joined((FLOOR, 1), (SPHERE, count), (ROW, self.dim))
        floor, spheres, rows = views
        numbers = self.height, self.margin, self.influence, self.rate, self.braking
        floor[0] = count, *numbers
        for sphere, link, given in zip(
            spheres, self._links, self._spheres, strict=True
        ):
            frame = model.frames[configuration.frame_id(link)]
            sphere["joint"], sphere["radius"] = frame.parentJoint, given[3]
            sphere["centre"] = frame.placement.act(given[:3])
        self.found, self.distances = rows["found"], rows["distance"]
        self.found[:], self.distances[:] = -1, np.inf
        self._model = model

    def own(self, configuration: Configuration) -> Vector:
        """Return the kernel's numbers."""
        return self._own

    def subject(self, row: int) -> str:
        """Return the link of a row of the last tick."""
        return self._links[int(self.found[row])]


class ObstacleLimit(RowLimit):
    """Slow what nears an obstacle, and never let it in.

    Each row keeps one point p of a link in front of the plane `n . x = c` that touches
    the obstacle where the two are nearest. With d = n . p - c - margin,

        n . p' >= -min(rate d, sqrt(2 braking d)),

    and where d is negative, outwards at no more than 0.2 m/s. Its owner writes `found`,
    `point`, `normal` and `offset` of the planes before each tick.

    Args:
        pairs: Names of a link of the robot and of an obstacle.
        margins: Distance that each pair keeps, m; negative where it may press.
        nearest: Number of rows.
        rate: Speed per distance left, 1/s.
        braking: Deceleration, m/s^2.

    Attributes:
        joints: Joint that moves the link of each pair, once bound.
        planes: `PLANE` records of the rows, once bound.

    Raises:
        ConfigError: If a number is out of range.
    """

    kernel: ClassVar[Any] = obstacle_rows
    kind = LimitKind.OBSTACLE

    def __init__(
        self,
        pairs: Sequence[LinkPair],
        margins: Sequence[float],
        *,
        nearest: int = 20,
        rate: float = 10.0,
        braking: float = 4.0,
    ) -> None:
        name = "ObstacleLimit"
        self.dim = check_count(f"{name}: nearest", nearest, least=1)
        self.rate = check_number(f"{name}: rate", rate, above=0.0)
        self.braking = check_number(f"{name}: braking", braking, above=0.0)
        self.pairs, self._margins = tuple(pairs), tuple(margins)
        self._model: pin.Model | None = None  # that the numbers belong to

    def bind(self, configuration: Configuration) -> None:
        """Resolve links to joints; UnknownNameError if one is no frame of the model."""
        model, count = configuration.model, len(self.pairs)
        if self._model is model:
            return
        links = [configuration.frame_id(pair.first) for pair in self.pairs]
        sections = (OBSTACLES, 1), (OBSTACLE_PAIR, count), (PLANE, self.dim)
        self._own, (settings, pairs, self.planes) = joined(*sections)
        settings[0] = count, self.rate, self.braking
        pairs["joint"] = [model.frames[link].parentJoint for link in links]
        pairs["margin"] = self._margins
        self.joints = pairs["joint"]
        self.planes["found"], self.planes["distance"] = -1, np.inf
        self._model = model

    def own(self, configuration: Configuration) -> Vector:
        """Return the kernel's numbers."""
        return self._own

    def subject(self, row: int) -> LinkPair:
        """Return the link and the obstacle of a row of the last tick."""
        return self.pairs[int(self.planes["found"][row])]
