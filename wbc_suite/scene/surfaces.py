"""Level surfaces of a scene, and the places of robots before them."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.scene.geom_bounds import box_corners, solid_geoms
from wbc_suite.typing import Indices, Matrix, Vector

LEVEL = math.cos(math.radians(1.0))
LEAST = 0.35  # shorter side of a surface that stands in for a table unasked, m
BELOW, ABOVE = 0.4, 0.2  # difference of its height to the table's, at most, m

DEPTH, HALF_WIDTH = 0.75, 0.35  # room of a robot before a surface, m
GAP = 0.15  # handles and edges in front of a surface that do not count, m
FROM, TO = 0.1, 1.7  # heights between which the room must be free, m


@dataclass(frozen=True, kw_only=True, slots=True)
class Surface:
    """A level rectangle; lengths in m, in the scene's frame.

    Attributes:
        middle: Its middle, shape (3,).
        yaw: Direction of its first side, rad.
        sides: Lengths of both sides.
    """

    name: str
    middle: Vector
    yaw: float
    sides: tuple[float, float]

    def from_side(self, k: int) -> tuple[float, float, float]:
        """Return the heading of one who looks at side k, the depth and the width."""
        heading = math.remainder(self.yaw + k * math.pi / 2, 2 * math.pi)
        return heading, self.sides[k % 2], self.sides[1 - k % 2]


def surface_of_geom(
    m: mujoco.MjModel, data: mujoco.MjData, geom: int
) -> Surface | None:
    """Return the upper face of the box around a geom; None if it is not level."""
    R, box = data.geom_xmat[geom].reshape(3, 3), m.geom_aabb[geom]
    middle = data.geom_xpos[geom] + R @ box[:3]
    return _upper_face(m.geom(geom).name, middle, R, box[3:])


def surface_at_site(
    m: mujoco.MjModel, data: mujoco.MjData, site: int, sides: tuple[float, float]
) -> Surface | None:
    """Return the upper face of a box site, or a surface around another site."""
    R, half = data.site_xmat[site].reshape(3, 3), m.site_size[site]
    if m.site_type[site] != mujoco.mjtGeom.mjGEOM_BOX:
        half = np.array([*sides, 0.0]) / 2
    return _upper_face(m.site(site).name, data.site_xpos[site], R, half)


def _upper_face(name: str, middle: Vector, R: Matrix, half: Vector) -> Surface | None:
    up = int(np.argmax(np.abs(R[2])))
    if abs(R[2, up]) < LEVEL:
        return None
    first, second = (k for k in range(3) if k != up)
    return Surface(
        name=name,
        middle=middle + np.array([0.0, 0.0, half[up]]),
        yaw=math.atan2(R[1, first], R[0, first]),
        sides=(2 * float(half[first]), 2 * float(half[second])),
    )


def box_tops(m: mujoco.MjModel, data: mujoco.MjData) -> list[Surface]:
    """Return the upper faces of level boxes that do not move, highest first."""
    boxes = still_geoms(m)
    boxes = boxes[m.geom_type[boxes] == mujoco.mjtGeom.mjGEOM_BOX]
    found = (surface_of_geom(m, data, int(geom)) for geom in boxes)
    tops = [top for top in found if top is not None]
    return sorted(tops, key=lambda t: (t.middle[2], min(t.sides)), reverse=True)


def suits(top: Surface, height: float) -> bool:
    """Whether a surface can stand in for a table of a height, m."""
    above = float(top.middle[2]) - height
    return min(top.sides) >= LEAST and -BELOW <= above <= ABOVE


def still_geoms(m: mujoco.MjModel) -> Indices:
    """Return the geoms but planes that collide and cannot move, shape (n,)."""
    solid, planes = solid_geoms(m), mujoco.mjtGeom.mjGEOM_PLANE
    still = m.body_weldid[m.geom_bodyid[solid]] == 0
    return solid[still & (m.geom_type[solid] != planes)]


def free_side(m: mujoco.MjModel, data: mujoco.MjData, top: Surface) -> int | None:
    """Return the side with room for a robot that turns it least; None without one."""
    sides = sorted(range(4), key=lambda k: abs(top.from_side(k)[0]))
    return next((k for k in sides if _has_room(m, data, top, k)), None)


def _has_room(m: mujoco.MjModel, data: mujoco.MjData, top: Surface, k: int) -> bool:
    heading, depth, _ = top.from_side(k)
    R = pin.utils.rotate("z", heading)
    corners = box_corners(m, data, still_geoms(m), top.middle, R)
    edge, floor = -depth / 2, -float(top.middle[2])
    low = np.array([edge - DEPTH, -HALF_WIDTH, floor + FROM])
    high = np.array([edge - GAP, HALF_WIDTH, floor + TO])
    inside = (corners[1] > low) & (corners[0] < high)
    return not inside.all(axis=1).any()
