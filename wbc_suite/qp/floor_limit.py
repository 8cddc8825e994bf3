"""Keep links above the floor that the robot stands on."""

from collections.abc import Mapping

import numpy as np

from wbc_suite.arguments import check_count, check_number
from wbc_suite.compiling import compiled
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.bounds import LimitKind
from wbc_suite.qp.limit import RowLimit
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["FloorLimit"]

_APART = 0.2  # m/s, greatest speed upwards of what is too low


class FloorLimit(RowLimit):
    """Slow what comes down, and never let it touch the floor.

    Shapes are convex hulls of spheres, so that the lowest sphere tells their distance
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

    Raises:
        ConfigError: If a number is out of range.
    """

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
        self.found: Indices = np.full(self.dim, -1, dtype=np.int64)
        self.distances: Vector = np.full(self.dim, np.inf)

    def bind(self, configuration: Configuration) -> None:
        """Resolve links to joints.

        Raises:
            UnknownNameError: If a link is no frame of the model.
        """
        model = configuration.model
        self._joints: Indices = np.zeros(len(self._links), dtype=np.int64)
        self._places: Matrix = self._spheres.copy()
        for k, link in enumerate(self._links):
            frame = model.frames[configuration.frame_id(link)]
            self._joints[k] = frame.parentJoint
            self._places[k, :3] = frame.placement.act(self._spheres[k, :3])
        self._moves: Matrix = np.zeros((len(model.joints), configuration.nv))
        for joint in set(self._joints.tolist()):
            self._moves[joint, configuration.joint_support(joint)] = 1.0

    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write the rows of the lowest spheres, `-J_z dq <= ...`."""
        placements, joints = configuration.placements, self._joints
        found, distances = self.found, self.distances
        _lowest(
            placements,
            joints,
            self._places,
            self.height,
            self.influence,
            found,
            distances,
        )
        jacobians = configuration.joint_jacobians
        _falling(placements, jacobians, joints, self._places, self._moves, found, G)
        _brake(distances, self.margin, self.rate, self.braking, dt, h)

    def label(self, row: int) -> str:
        """Return the link of a row of the last tick."""
        return self._links[int(self.found[row])]


@compiled
def _lowest(
    placements: Matrix,
    joints: Indices,
    spheres: Matrix,
    height: float,
    influence: float,
    found: Indices,
    distances: Vector,
) -> None:
    """Find the lowest spheres.

    Args:
        placements: Joint poses, shape (njoints, 12).
        joints: Joint of each sphere, shape (n,).
        spheres: Centre in its joint and radius of each, shape (n, 4).
        height: Of the floor, m.
        influence: Spheres further away are left out, m.
        found: Output, sphere of each row, lowest first, -1 where there is none.
        distances: Output, distance from the floor, m; inf where there is none.
    """
    rows = found.shape[0]
    found[:], distances[:] = -1, np.inf
    for k in range(joints.shape[0]):
        T, s = placements[joints[k]], spheres[k]
        z = T[11] + T[2] * s[0] + T[5] * s[1] + T[8] * s[2]
        distance = z - s[3] - height
        if distance < min(influence, distances[rows - 1]):
            row = rows - 1
            while row > 0 and distances[row - 1] > distance:
                distances[row], found[row] = distances[row - 1], found[row - 1]
                row -= 1
            distances[row], found[row] = distance, k


@compiled
def _falling(
    placements: Matrix,
    joint_jacobians: Matrix,
    joints: Indices,
    spheres: Matrix,
    moves: Matrix,
    found: Indices,
    G: Matrix,
) -> None:
    """Write the negative derivative of the height of spheres, shape (k, nv).

    Args:
        placements: Joint poses, shape (njoints, 12).
        joint_jacobians: Joint Jacobians, transposed, shape (nv, 6).
        joints: Joint of each sphere, shape (n,).
        spheres: Centre in its joint and radius of each, shape (n, 4).
        moves: 1 where a velocity moves a joint, shape (njoints, nv).
        found: Sphere of each row, -1 where there is none.
        G: Output; 0 where there is none.
    """
    for row in range(found.shape[0]):
        G[row] = 0.0
        if found[row] < 0:
            continue
        joint, s = joints[found[row]], spheres[found[row]]
        T = placements[joint]
        x = T[9] + T[0] * s[0] + T[3] * s[1] + T[6] * s[2]
        y = T[10] + T[1] * s[0] + T[4] * s[1] + T[7] * s[2]
        for col in range(G.shape[1]):
            J = joint_jacobians[col]
            G[row, col] = -moves[joint, col] * (J[2] + J[3] * y - J[4] * x)


@compiled
def _brake(
    distances: Vector, margin: float, rate: float, braking: float, dt: float, h: Vector
) -> None:
    """Write how far each sphere may come down; endless distances bind nothing."""
    for i in range(h.shape[0]):
        room = distances[i] - margin
        speed = min(rate * room, np.sqrt(2.0 * braking * max(room, 0.0)))
        h[i] = min(max(speed, -_APART) * dt, UNBOUNDED)
