"""Predicates of success in world axes: on, inside, inserted, held, released, at rest.

A benchmark's success is put together from these, so that words mean the same in all.
"""

import math
from collections.abc import Collection, Mapping, Sequence

import mujoco
import numpy as np

from wbc_suite.scene.objects import ObjectState
from wbc_suite.sensing.hands import Hand, pairs_in_contact
from wbc_suite.typing import Matrix, Vector

GRIP_ANGLE = math.radians(120.0)
SLIP, SPIN = 0.2, 1.0  # m/s and rad/s, between a hand and what it holds, at most
LOAD = 1.2
"""What a hand must be able to bear to hold a thing, in weights of it: some that it
could only just bear are lost (benchmarks/two_sided.py)."""
BALANCE = 1e-3
"""Distance of a centre of mass from the area of its support, at most, m."""
UPWARD = 0.1
"""Least z of the normal of a contact that bears a thing."""
ON_FLOOR = 0.01
"""Height of the lowest point of a thing above the floor that it lies on, at most, m."""


class Predicates:
    """What holds now between the objects and the hands of a scene.

    Args:
        data: The simulation.
        states: The objects, by name.
        hands: The hands of all robots.
        robot_geoms: The geoms of all robots.
        grip_angle: Least angle between the sides from which two links clamp, rad.
    """

    def __init__(
        self,
        data: mujoco.MjData,
        states: Mapping[str, ObjectState],
        hands: Sequence[Hand],
        robot_geoms: Collection[int],
        *,
        grip_angle: float = GRIP_ANGLE,
    ) -> None:
        self.data, self.states, self.hands = data, states, hands
        self.robot_geoms, self.grip_angle = frozenset(robot_geoms), grip_angle

    def in_contact(self, first: Collection[int], second: Collection[int]) -> bool:
        """Whether a geom of the first collection touches one of the second."""
        return any(
            (a in first and b in second) or (a in second and b in first)
            for a, b in pairs_in_contact(self.data)
        )

    def touched_by(self, name: str) -> set[int]:
        """Return the geoms that an object touches."""
        own, pairs = self.states[name].geoms, pairs_in_contact(self.data)
        return {g for pair in pairs if not own.isdisjoint(pair) for g in pair} - own

    def touching(self, first: str, second: str) -> bool:
        """Whether two objects touch."""
        return not self.states[second].geoms.isdisjoint(self.touched_by(first))

    def hands_at(self, name: str) -> list[Hand]:
        """Return the hands that touch an object."""
        touched = self.touched_by(name)
        return [hand for hand in self.hands if any(map(hand.owns, touched))]

    def released(self, name: str) -> bool:
        """Whether no robot touches an object."""
        return self.robot_geoms.isdisjoint(self.touched_by(name))

    def grasped(self, name: str) -> bool:
        """Whether two links of one gripper touch an object."""
        geoms = self.states[name].geoms
        return any(hand.grasps(geoms) for hand in self.hands)

    def held(self, name: str) -> bool:
        """Whether a hand clamps an object, which moves with it."""
        geoms = self.states[name].geoms
        return any(self.holds(hand, name, geoms) for hand in self.hands)

    def holds(self, hand: Hand, name: str, geoms: Collection[int]) -> bool:
        """Whether a hand clamps geoms of an object, which moves with it.

        It can bear the weight then, whichever way that pulls.
        """
        load = LOAD * self.states[name].weight
        return self._moves_with(hand, name, geoms) and hand.bears(geoms, load)

    def hold_together(self, name: str) -> bool:
        """Whether all hands clamp an object, which moves with them.

        The friction of each can bear half of its weight. Handles keep it in the other
        directions, where thumbs alone hold less than `holds` asks.
        """
        state = self.states[name]
        return all(
            hand.clamps(state.geoms, self.grip_angle)
            and hand.slip(state.body) < SLIP
            and hand.friction(state.geoms) > 0.5 * state.weight
            for hand in self.hands
        )

    def _moves_with(self, hand: Hand, name: str, geoms: Collection[int]) -> bool:
        """Whether an object moves with a hand, whose links touch it from two sides."""
        body = self.states[name].body
        moves = hand.slip(body) < SLIP and hand.spin(body) < SPIN
        return moves and hand.clamps(geoms, self.grip_angle)

    def supported(self, name: str) -> bool:
        """Whether contacts bear an object, which stands on them or hangs from them.

        One at least must push it up, and its centre must be over the convex hull of all
        contact points, seen from above, or below one of them.
        """
        state, contact = self.states[name], self.data.contact
        own, pairs = state.geoms, pairs_in_contact(self.data)
        sides = np.array([(b in own) - (a in own) for a, b in pairs], dtype=np.float64)
        points, center = contact.pos[np.nonzero(sides)], self.data.xipos[state.body]
        if not (sides * contact.frame[:, 2] > UPWARD).any():
            return False
        hangs = points[:, 2].max() > center[2]
        over = hull_distances(points[:, :2], center[None, :2]).item() < BALANCE
        return hangs or over

    def at_rest(self, name: str) -> bool:
        """Whether an object lies or hangs still on something that is no robot."""
        still = self.states[name].is_still and self.released(name)
        return still and self.supported(name)

    def on(self, name: str, below: Collection[int]) -> bool:
        """Whether an object is at rest, and touches geoms of `below` only.

        They carry it then, whichever way they are turned.
        """
        return self.touched_by(name) <= set(below) and self.at_rest(name)

    def upright(self, name: str, tilt: float, *, flipped: bool = False) -> bool:
        """Whether an object's z axis points up, or also down, to within `tilt`, rad."""
        up = self.states[name].rotation.item(2, 2)
        return (abs(up) if flipped else up) > math.cos(tilt)

    def inside(self, name: str, middle: Sequence[float], size: Sequence[float]) -> bool:
        """Whether an object is down on a floor, its origin between the walls.

        Args:
            name: The object.
            middle: Middle of the floor, m.
            size: Distance of the walls along x and y, m.
        """
        state = self.states[name]
        x, y, z = (state.position - middle).tolist()
        if abs(x) >= size[0] / 2 or abs(y) >= size[1] / 2:
            return False
        w, i, j, k = self.data.xquat[state.body].tolist()
        return abs(z - state.extent((w, i, j, k)).bottom) < ON_FLOOR


def crossing(
    start: Vector, end: Vector, middle: Vector, R: Matrix
) -> tuple[float, float, float]:
    """Return where a line crosses the plane of a hole; whatever is inserted does.

    Args:
        start: A point of the line, m.
        end: Another, m.
        middle: Middle of the hole, m.
        R: Rotation of the hole's axes, z along its normal, shape (3, 3).

    Returns:
        x and y in the axes of the hole, m, and the share of the way from `start` to
        `end`; all are infinite for a line parallel to the plane.
    """
    way, normal = end - start, R[:, 2]
    along = float(way @ normal)
    if abs(along) < 1e-6:
        return math.inf, math.inf, math.inf
    share = float((middle - start) @ normal) / along
    x, y, _ = ((start + share * way - middle) @ R).tolist()
    return x, y, share


def hull_distances(hull: Matrix, points: Matrix) -> Vector:
    """Return the distances of points to the convex hull of others, 0 inside, (n,).

    The points, shape (n, 2), and those that span the hull, shape (k, 2), are in one
    plane.
    """
    if len(hull) == 1:
        return np.linalg.norm(points - hull[0], axis=1)
    i, k = np.triu_indices(len(hull), 1)  # all pairs: edges and diagonals
    start, edge = hull[i], hull[k] - hull[i]
    along = points[:, None] - start
    squares = np.maximum(np.sum(edge * edge, axis=1), 1e-18)
    t = np.clip(np.sum(along * edge, axis=2) / squares, 0.0, 1.0)
    gaps = np.linalg.norm(along - t[..., None] * edge, axis=2).min(axis=1)
    normal = np.column_stack([-edge[:, 1], edge[:, 0]])
    height = np.sum(along * normal, axis=2)
    side = np.sum((hull[:, None] - start) * normal, axis=2)
    if np.ptp(side, axis=0).max() < 1e-12:
        return gaps  # all points of the hull on one line
    left, right = side.min(axis=0) > -1e-12, side.max(axis=0) < 1e-12
    inside = ((height >= 0.0) | ~left) & ((height <= 0.0) | ~right)
    return np.where(inside.all(axis=1), 0.0, gaps)
