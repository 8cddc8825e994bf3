"""Keep links above the floor that the robot stands on."""

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_count, check_number
from wbc_suite.compiling import as_argument, compiled, struct
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays, compute_joint_poses
from wbc_suite.qp.kernel import Kernel
from wbc_suite.qp.limit import LimitKind, RowLimit
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.typing import Indices, Matrix, Vector

_SEPARATION = 0.2
"""m/s, greatest speed upwards of what is too low."""


@struct
class SphereArrays(NamedTuple):
    """n spheres, of which the k lowest have a row.

    Attributes:
        joint: Joint of each sphere, shape (n,).
        sphere: Centre in its joint and radius of each, m, shape (n, 4).
        moves: 1 where a velocity moves a joint, else 0, shape (njoints, nv).
        options: Height of the floor, influence, margin (m), rate (1/s) and braking
            (m/s^2), shape (5,).
        found: Output, sphere of each row, lowest first, -1 where there is none, (k,).
        distance: Output, distance from the floor, m; inf where there is none, (k,).
    """

    joint: Indices
    sphere: Matrix
    moves: Matrix
    options: Vector
    found: Indices
    distance: Vector


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

    Raises:
        ConfigError: If a number is out of range.
    """

    kernel: ClassVar[Kernel] = Kernel.FLOOR
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
        self._model: pin.Model | None = None  # that the arrays belong to

    def bind(self, configuration: Configuration) -> None:
        """Resolve links to joints. Stacks on one model share the arrays.

        Raises:
            UnknownNameError: If a link is no frame of the model.
        """
        model = configuration.model
        if self._model is model:
            return
        joint, sphere = np.zeros(len(self._links), dtype=np.int64), self._spheres.copy()
        for k, link in enumerate(self._links):
            frame = model.frames[configuration.frame_id(link)]
            joint[k] = frame.parentJoint
            sphere[k, :3] = frame.placement.act(self._spheres[k, :3])
        moves: Matrix = np.zeros((len(model.joints), configuration.nv))
        for j in set(joint.tolist()):
            moves[j, configuration.joint_support(j)] = 1.0
        options = self.height, self.influence, self.margin, self.rate, self.braking
        self.arrays = SphereArrays(
            joint=joint,
            sphere=sphere,
            moves=moves,
            options=np.array(options),
            found=np.full(self.dim, -1, dtype=np.int64),
            distance=np.full(self.dim, np.inf),
        )
        self.argument = as_argument(self.arrays)
        self._model = model

    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write the rows of the lowest spheres, `-J_z dq <= ...`."""
        compute_joint_poses(configuration.robot)
        floor_rows(configuration.robot, self.argument, dt, G, h)

    @property
    def found(self) -> Indices:
        """Sphere of each row of the last tick, lowest first; -1 where there is none."""
        return self.arrays.found

    @property
    def distances(self) -> Vector:
        """Distance of each row's sphere from the floor, m; inf where there is none."""
        return self.arrays.distance

    def subject(self, row: int) -> str:
        """Return the link of a row of the last tick."""
        return self._links[int(self.found[row])]


@compiled
def floor_rows(
    robot: RobotArrays, spheres: SphereArrays, dt: float, G: Matrix, h: Vector
) -> None:
    """Write the rows of the lowest spheres.

    Args:
        robot: The robot; joint poses are current.
        spheres: The spheres.
        dt: Step, s.
        G: Output, negative derivative of the height of each, shape (k, nv).
        h: Output, how far each may come down, m, shape (k,).
    """
    _find_lowest(robot, spheres)
    margin, rate, braking = spheres.options[2], spheres.options[3], spheres.options[4]
    for row in range(h.shape[0]):
        left = spheres.distance[row] - margin
        speed = min(rate * left, np.sqrt(2.0 * braking * max(left, 0.0)))
        h[row] = min(max(speed, -_SEPARATION) * dt, UNBOUNDED)
        k = spheres.found[row]
        for col in range(G.shape[1]):
            G[row, col] = 0.0
        if k < 0:
            continue
        T, s = robot.pose[spheres.joint[k]], spheres.sphere[k]
        x = T[9] + T[0] * s[0] + T[3] * s[1] + T[6] * s[2]
        y = T[10] + T[1] * s[0] + T[4] * s[1] + T[7] * s[2]
        for col in range(G.shape[1]):
            J = robot.jacobian[col]
            speed = J[2] + J[3] * y - J[4] * x
            G[row, col] = -spheres.moves[spheres.joint[k], col] * speed


@compiled
def _find_lowest(robot: RobotArrays, spheres: SphereArrays) -> None:
    """Find the lowest spheres and their distances from the floor."""
    found, distance, rows = spheres.found, spheres.distance, spheres.found.shape[0]
    height, influence = spheres.options[0], spheres.options[1]
    for row in range(rows):
        found[row], distance[row] = -1, np.inf
    for k in range(spheres.joint.shape[0]):
        T, s = robot.pose[spheres.joint[k]], spheres.sphere[k]
        z = T[11] + T[2] * s[0] + T[5] * s[1] + T[8] * s[2]
        d = z - s[3] - height
        if d < min(influence, distance[rows - 1]):
            row = rows - 1
            while row > 0 and distance[row - 1] > d:
                distance[row], found[row] = distance[row - 1], found[row - 1]
                row -= 1
            distance[row], found[row] = d, k
