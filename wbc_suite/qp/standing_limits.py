"""Limits of robots that stand: where they would tip, what their motors carry."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from wbc_suite.arguments import check_number
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.limit import LimitKind, RowLimit
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.typing import Indices, Matrix, Vector

GRAVITY = 9.81  # m/s^2
RETURN_SPEED = 0.05  # m/s, from outside the limit
JUMP = 2.0  # m/s; a root that moved faster was put elsewhere
MOVED = 1e-3  # m; soles that moved by less keep their polygon
WEIGHT_RETURN = 0.1  # of the effort per second, from beyond it


@dataclass(frozen=True, kw_only=True, slots=True)
class Sole:
    """A flat rectangle on the ground, in the x-y plane of a frame.

    Attributes:
        frame: The frame; its x axis points to the toes.
        x: From heel to toes, m.
        y: From right to left, m.
    """

    frame: str
    x: tuple[float, float]
    y: tuple[float, float]

    @property
    def corners(self) -> Matrix:
        """Corners in the frame, m, shape (4, 3)."""
        return np.array([[x, y, 0.0] for x in self.x for y in self.y])


class SupportLimit(RowLimit):
    """Keep the capture point over the soles.

    A body at the height h above its support, pushed by its centre of mass's velocity,
    comes to rest on a point foot at the capture point `xi = c + c' / omega`, where
    `omega = sqrt(g / h)`. As long as xi is inside the convex hull of the soles, some
    pressure on them can stop the robot. For each edge n . p <= d of the hull,

        n . (c + J_c v / omega) <= d - margin.

    The rows are also a speed limit that falls to zero at the edge. With a pressure
    margin, the acceleration a between two steps is bounded as well, so that the point p
    where the ground pushes stays inside the hull. L is the angular momentum about c:

        p_x = c_x - c_x'' / omega^2 - L_y' / (m g)
        p_y = c_y - c_y'' / omega^2 + L_x' / (m g),    p = c - P a
        n . (c - P (v - v_before) / dt) <= d - pressure_margin.

    Args:
        soles: What stands on the ground.
        margin: Distance that xi keeps from the edges, m.
        pressure_margin: Distance that the pressure point keeps from the edges, m; None
            leaves accelerations alone.

    Raises:
        ConfigError: If there is no sole, or the margin is negative.

    Source: Koolen et al. (2012), "Capturability-based analysis and control of legged
    locomotion, part 1", IJRR 31(9).
    """

    kind = LimitKind.BALANCE

    def __init__(
        self,
        soles: Sequence[Sole],
        *,
        margin: float = 0.03,
        pressure_margin: float | None = None,
    ) -> None:
        if not soles:
            raise ConfigError("SupportLimit: needs a sole to stand on.")
        self.soles = tuple(soles)
        self.margin = check_number("SupportLimit: margin", margin, least=0.0)
        self.pressure_margin = pressure_margin
        self._edges = 4 * len(self.soles)  # at most
        self.dim = self._edges * (1 if pressure_margin is None else 2)
        self._has_moved, self._before = np.zeros(1), np.zeros(0)
        self._place: Matrix = np.full((4 * len(self.soles), 3), np.inf)
        self._hull_place: Matrix = self._place.copy()  # that the hull is of

    def reset(self) -> None:
        """Forget how the robot moved and where the soles were."""
        self._has_moved[0], self._place[:] = 0.0, np.inf

    @property
    def memory(self) -> tuple[NDArray[Any], ...]:
        """Whether and where the robot was at the last tick, and where the soles are."""
        return self._has_moved, self._before, self._place

    def bind(self, configuration: Configuration) -> None:
        """Resolve the frames of the soles."""
        self._frames = [configuration.frame_id(sole.frame) for sole in self.soles]
        self._mass = pin.computeTotalMass(configuration.model)
        if self._before.size != configuration.nq:
            self._before = np.zeros(configuration.nq)
        self._update(configuration)

    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write one row, or two, per edge of the hull."""
        self._update(configuration)
        edges, com = len(self._offsets), configuration.com.copy()
        height = max(float(com[2] - self._place[:, 2].mean()), 0.1)
        omega = np.sqrt(GRAVITY / height)
        room = self._offsets - self._normals @ com[:2]
        G[:], h[:] = 0.0, UNBOUNDED
        G[:edges] = self._normals @ configuration.com_jacobian[:2]
        h[:edges] = np.maximum(omega * (room - self.margin), -RETURN_SPEED) * dt
        if self.pressure_margin is not None:
            pressed = slice(self._edges, self._edges + edges)
            P = _pressure_map(configuration, omega, self._mass)
            G[pressed] = -self._normals @ P
            room = np.maximum(room - self.pressure_margin, 0.0)
            h[pressed] = dt**2 * room + G[pressed] @ self._last_step(configuration, dt)

    def subject(self, row: int) -> str:
        """Return over which side the robot would fall."""
        (x, y), (forward, sideways) = self._normals[row % self._edges], self._forward
        ahead, left = forward * x + sideways * y, forward * y - sideways * x
        if abs(ahead) > abs(left):
            return f"centre of mass at the {'toes' if ahead > 0 else 'heels'}"
        return f"centre of mass at the {'left' if left > 0 else 'right'}"

    def _last_step(self, configuration: Configuration, dt: float) -> Vector:
        """Return how the robot came here from the last tick, shape (nv,)."""
        before, has_moved = self._before.copy(), bool(self._has_moved[0])
        self._before[:], self._has_moved[0] = configuration.q, 1.0
        if not has_moved:
            return np.zeros(configuration.nv)
        step = pin.difference(configuration.model, before, self._before)
        fast = float(np.abs(step[configuration.root_linear]).max(initial=0.0))
        return step if fast < JUMP * dt else np.zeros(configuration.nv)

    def _update(self, configuration: Configuration) -> None:
        """Recompute the hull if the soles have moved."""
        poses = [configuration.frame_pose(frame) for frame in self._frames]
        place = np.concatenate(
            [
                sole.corners @ pose.rotation.T + pose.translation
                for sole, pose in zip(self.soles, poses, strict=True)
            ]
        )
        if np.abs(place - self._place).max() >= MOVED:
            self._place[:] = place
        if np.array_equal(self._place, self._hull_place):
            return
        self._hull_place[:], place = self._place, self._place
        self._forward = poses[0].rotation[:2, 0]
        hull = convex_hull(place[:, :2])
        along = np.roll(hull, -1, axis=0) - hull
        along /= np.linalg.norm(along, axis=1)[:, None]
        self._normals = np.stack([along[:, 1], -along[:, 0]], axis=1)
        self._offsets: Vector = np.einsum("ij,ij->i", self._normals, hull)


class WeightLimit(RowLimit):
    """Keep the torque that gravity asks of some motors within their efforts.

    With g(q) the generalised gravity, two rows for each joint i,

        -+ (dg_i / dq) v <= rate (limit_i +- g_i).

    Args:
        torques: Greatest torque or force of each joint by name, N m or N.
        rate: How fast what is left may be used up, 1/s. A pendulum of length l brakes
            by rate^2 l / g of what is left: no more than that for 2.4 m and 2 /s.

    Raises:
        ConfigError: If a number is not positive.
    """

    kind = LimitKind.EFFORT
    unit = "N m"

    def __init__(self, torques: Mapping[str, float], rate: float = 2.0) -> None:
        for name, value in torques.items():
            check_number(f"WeightLimit: '{name}'", value, above=0.0)
        check_number("WeightLimit: rate", rate, above=0.0)
        self._rate = rate
        self.names = tuple(torques)
        self._torques: Vector = np.array(list(torques.values()), dtype=np.float64)
        self.dim = 2 * len(self.names)

    def bind(self, configuration: Configuration) -> None:
        """Resolve the joints."""
        joints = [configuration.joint_id(name) for name in self.names]
        self._index: Indices = np.array(
            [configuration.model.joints[j].idx_v for j in joints], dtype=np.int64
        )

    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write two rows per joint: upper, then lower."""
        model, data, q = configuration.model, configuration.data, configuration.q
        slope = pin.computeGeneralizedGravityDerivatives(model, data, q)[self._index]
        count = len(self.names)
        G[:count], G[count:] = slope, -slope
        h[:] = dt * np.maximum(
            self._rate * self.room(configuration),
            -WEIGHT_RETURN * np.tile(self._torques, 2),
        )

    def room(self, configuration: Configuration) -> Vector:
        """Return what each joint could hold more, N m or N: upwards, then downwards."""
        model, data, q = configuration.model, configuration.data, configuration.q
        torque = pin.computeGeneralizedGravity(model, data, q)[self._index]
        return np.concatenate([self._torques - torque, self._torques + torque])

    def subject(self, row: int) -> str:
        """Return which motor is at its torque limit."""
        return f"{self.names[row % len(self.names)]} at its torque limit"


def _pressure_map(configuration: Configuration, omega: float, mass: float) -> Matrix:
    """Return P, shape (2, nv): acceleration a moves the pressure point to c - P a."""
    model, data = configuration.model, configuration.data
    momentum = pin.computeCentroidalMap(model, data, configuration.q)
    turning = np.stack([momentum[4], -momentum[3]]) / (mass * GRAVITY)
    return momentum[:2] / (mass * omega**2) + turning


def convex_hull(points: Matrix) -> Matrix:
    """Return the corners of the convex hull of points, (n, 2), counterclockwise.

    Source: Andrew (1979), "Another efficient algorithm for convex hulls in two
    dimensions", Information Processing Letters 9(5).
    """
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))]
    lower, upper = _chain(ordered), _chain(ordered[::-1])
    return np.array(lower[:-1] + upper[:-1])


def _chain(points: Matrix) -> list[Vector]:
    chain: list[Vector] = []
    for point in points:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 1e-9:
            chain.pop()
        chain.append(point)
    return chain


def _turn(a: Vector, b: Vector, c: Vector) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
