"""Keep links above the floor that the robot stands on."""

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_count, check_number
from wbc_suite.compiling import as_argument, inner, struct
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays, compute_joint_poses
from wbc_suite.qp.kernel import Kernel
from wbc_suite.qp.limit import LimitKind, RowLimit, joint_movers, write_rows
from wbc_suite.qp.self_collision_rows import greatest_approach, insert_nearest
from wbc_suite.typing import Indices, Matrix, Vector


@struct
class SphereArrays(NamedTuple):
    """n spheres, of which the k lowest have a row, in m; see `FloorLimit`."""

    joint: Indices  # (n,), joint of each sphere
    sphere: Matrix  # (n, 4), centre in its joint and radius of each
    moves: Matrix  # (njoints, nv), 1 where a velocity moves a joint, else 0
    height: float
    margin: float
    influence: float
    rate: float
    braking: float
    found: Indices  # (k,), output: sphere of each row, lowest first, -1 for none
    distance: Vector  # (k,), output: distance from the floor, inf for none


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
        """Resolve links to joints; UnknownNameError if one is no frame of the model."""
        model, sphere = configuration.model, self._spheres.copy()
        if self._model is model:
            return
        links = [model.frames[configuration.frame_id(link)] for link in self._links]
        for row, frame in zip(sphere, links, strict=True):
            row[:3] = frame.placement.act(row[:3])
        self.arrays = SphereArrays(
            joint=np.array([frame.parentJoint for frame in links], dtype=np.int64),
            sphere=sphere,
            moves=joint_movers(configuration),
            height=self.height,
            margin=self.margin,
            influence=self.influence,
            rate=self.rate,
            braking=self.braking,
            found=np.full(self.dim, -1, dtype=np.int64),
            distance=np.full(self.dim, np.inf),
        )
        self.found, self.distances = self.arrays.found, self.arrays.distance
        self.argument = as_argument(self.arrays)
        self._model = model

    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write the rows of the lowest spheres, `-J_z dq <= ...`."""
        compute_joint_poses(configuration.robot)
        write_rows(floor_rows, configuration.robot, self.argument, dt, G, h)

    def subject(self, row: int) -> str:
        """Return the link of a row of the last tick."""
        return self._links[int(self.found[row])]


@inner
def floor_rows(
    robot: RobotArrays, spheres: SphereArrays, dt: float, G: Matrix, h: Vector
) -> None:
    """Write the rows of the lowest spheres; joint poses are current.

    G, shape (k, nv), gets the negative derivative of the height of each; h gets how far
    it may come down in dt seconds, m.
    """
    _find_lowest(robot, spheres)
    G[:] = 0.0
    for row in range(h.shape[0]):
        left, k = spheres.distance[row] - spheres.margin, spheres.found[row]
        h[row] = greatest_approach(left, spheres.rate, spheres.braking, dt)
        if k < 0:
            continue
        T, s = robot.pose[spheres.joint[k]], spheres.sphere[k]
        x = T[9] + T[0] * s[0] + T[3] * s[1] + T[6] * s[2]
        y = T[10] + T[1] * s[0] + T[4] * s[1] + T[7] * s[2]
        for col in range(G.shape[1]):
            J = robot.jacobian[col]
            speed = J[2] + J[3] * y - J[4] * x
            G[row, col] = -spheres.moves[spheres.joint[k], col] * speed


@inner
def _find_lowest(robot: RobotArrays, spheres: SphereArrays) -> None:
    """Find the lowest spheres and their distances from the floor."""
    found, distance, count = spheres.found, spheres.distance, 0
    found[:], distance[:] = -1, np.inf
    for k in range(spheres.joint.shape[0]):
        T, s = robot.pose[spheres.joint[k]], spheres.sphere[k]
        z = T[11] + T[2] * s[0] + T[5] * s[1] + T[8] * s[2]
        d = z - s[3] - spheres.height
        if d < min(spheres.influence, distance[-1]):
            insert_nearest(found, distance, count, k, d)
            count += 1
