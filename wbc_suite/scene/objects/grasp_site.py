"""Grasp sites: where and how a hand can hold an object."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from wbc_suite.robot.shapes import Vector3

AXES = tuple(np.eye(3))


@dataclass(frozen=True, kw_only=True, slots=True)
class GraspSite:
    """A pose of a hand at which it can hold an object, in the object's frame.

    Axes are those of `Synergy.grasps`: a hand approaches along its z axis and closes
    along its y axis.

    Attributes:
        pos: The point between the fingers, m.
        approach: Unit vector along which the hand comes.
        closing: Unit vector along which its fingers close, at right angles to it.
        grasp: Kind of grasp, `pinch` between finger tips or `wrap` around a bar.
        tilt: Greatest turn about the closing axis by which it may be held too, rad.
        name: Name of the place, where an object has several, such as handles.
    """

    pos: Vector3 = (0.0, 0.0, 0.0)
    approach: Vector3
    closing: Vector3
    grasp: str = "pinch"
    tilt: float = 0.0
    name: str = ""

    @property
    def pose(self) -> pin.SE3:
        """Pose of the hand in the object's frame."""
        z, y = np.array(self.approach), np.array(self.closing)
        R = np.column_stack([np.cross(y, z), y, z])
        return pin.SE3(R, np.array(self.pos))

    def turned(self) -> "GraspSite":
        """Return the same grasp with the fingers exchanged."""
        x, y, z = self.closing
        return replace(self, closing=(-x, -y, -z))

    def at(self, pos: Vector3) -> "GraspSite":
        """Return it at another point, m."""
        return replace(self, pos=pos)


def box_grasps(
    half_size: Vector3, *, widest: float = 0.07, tilt: float = 0.6
) -> tuple[GraspSite, ...]:
    """Return the grasps of a box at its middle: each face, fingers on two others.

    Fingers close on faces that are at most `widest` apart, m.
    """
    found = []
    for face, side in itertools.permutations(range(3), 2):
        if 2.0 * half_size[side] > widest:
            continue
        for a, b in itertools.product((1.0, -1.0), repeat=2):
            approach, closing = vector(a * AXES[face]), vector(b * AXES[side])
            found.append(GraspSite(approach=approach, closing=closing, tilt=tilt))
    return tuple(found)


def rod_grasps(
    positions: Sequence[Vector3],
    *,
    axis: int,
    steps: int = 8,
    grasp: str = "pinch",
    tilt: float = 0.6,
    lift: float = 0.0,
    name: str = "",
) -> tuple[GraspSite, ...]:
    """Return grasps across a round rod along an axis (0, 1, 2), from all around.

    Hands stay by `lift` before the axis, m, so that fingers are clear of what the rod
    lies on.
    """
    along, first = AXES[axis], AXES[(axis + 1) % 3]
    found = []
    for pos, k in itertools.product(positions, range(steps)):
        angle = 2.0 * math.pi * k / steps
        approach = math.cos(angle) * first + math.sin(angle) * np.cross(along, first)
        one = GraspSite(
            pos=vector(np.array(pos) - lift * approach),
            approach=vector(approach),
            closing=vector(np.cross(approach, along)),
            grasp=grasp,
            tilt=tilt,
            name=name,
        )
        found += [one, one.turned()]
    return tuple(found)


def top_grasps(
    pos: Vector3, closings: Sequence[Vector3], *, tilt: float = 0.0
) -> tuple[GraspSite, ...]:
    """Return grasps at a point from above, along -z, by axes on which fingers close."""
    down = (0.0, 0.0, -1.0)
    found = [GraspSite(pos=pos, approach=down, closing=c, tilt=tilt) for c in closings]
    return tuple(turn for one in found for turn in (one, one.turned()))


def end_grasps(
    pos: Vector3, *, axis: int, steps: int = 8, tilt: float = 0.0
) -> tuple[GraspSite, ...]:
    """Return grasps of an upright rod from both ends, fingers across it."""
    along, first = AXES[axis], AXES[(axis + 1) % 3]
    found = []
    for sign, k in itertools.product((1.0, -1.0), range(steps)):
        angle = 2.0 * math.pi * k / steps
        closing = math.cos(angle) * first + math.sin(angle) * np.cross(along, first)
        found.append(
            GraspSite(
                pos=pos,
                approach=vector(sign * along),
                closing=vector(closing),
                tilt=tilt,
            )
        )
    return tuple(found)


def vector(values: np.ndarray) -> Vector3:
    """Return three numbers as a tuple."""
    x, y, z = (float(v) for v in values)
    return x, y, z
