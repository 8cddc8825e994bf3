"""Keep links out of things that do not move."""

from collections.abc import Sequence
from typing import ClassVar, NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_count, check_number
from wbc_suite.compiling import as_argument, inner, struct
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays, compute_joint_poses
from wbc_suite.qp.kernel import Kernel
from wbc_suite.qp.limit import LimitKind, RowLimit, joint_movers, write_rows
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.qp.self_collision_limit import LinkPair
from wbc_suite.qp.self_collision_rows import greatest_approach, speed_along
from wbc_suite.typing import Indices, Matrix, Vector


@struct
class ObstacleArrays(NamedTuple):
    """p pairs of a link and an obstacle, of which k have a row; see `ObstacleLimit`."""

    joint: Indices  # (p,), joint of each pair's link
    margin: Vector  # (p,), distance that is kept, m
    moves: Matrix  # (njoints, nv), 1 where a velocity moves a joint, else 0
    rate: float
    braking: float
    found: Indices  # (k,), pair of each row, -1 for none
    point: Matrix  # (k, 3), nearest point of the link, in its joint, m
    plane: Matrix  # (k, 4), normal towards the link in the world, and offset, m
    distance: Vector  # (k,), output: distance of the point from the plane, m


class ObstacleLimit(RowLimit):
    """Slow what nears an obstacle, and never let it in.

    Each row keeps one point p of a link in front of the plane `n . x = c` that touches
    the obstacle where the two are nearest. With d = n . p - c - margin,

        n . p' >= -min(rate d, sqrt(2 braking d)),

    and where d is negative, outwards at no more than 0.2 m/s. Its owner writes `found`,
    `point` and `plane` of `arrays` before each tick.

    Args:
        pairs: Names of a link of the robot and of an obstacle.
        margins: Distance that each pair keeps, m; negative where it may press.
        nearest: Number of rows.
        rate: Speed per distance left, 1/s.
        braking: Deceleration, m/s^2.

    Raises:
        ConfigError: If a number is out of range.
    """

    kernel: ClassVar[Kernel] = Kernel.OBSTACLE
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
        self._model: pin.Model | None = None  # that the arrays belong to

    def bind(self, configuration: Configuration) -> None:
        """Resolve links to joints; UnknownNameError if one is no frame of the model."""
        model = configuration.model
        if self._model is model:
            return
        links = [configuration.frame_id(pair.first) for pair in self.pairs]
        joints = [model.frames[link].parentJoint for link in links]
        self.arrays = ObstacleArrays(
            joint=np.array(joints, dtype=np.int64),
            margin=np.array(self._margins, dtype=np.float64),
            moves=joint_movers(configuration),
            rate=self.rate,
            braking=self.braking,
            found=np.full(self.dim, -1, dtype=np.int64),
            point=np.zeros((self.dim, 3)),
            plane=np.zeros((self.dim, 4)),
            distance=np.full(self.dim, np.inf),
        )
        self.argument = as_argument(self.arrays)
        self._model = model

    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write the rows of the points, `-n . J_p dq <= ...`."""
        compute_joint_poses(configuration.robot)
        write_rows(obstacle_rows, configuration.robot, self.argument, dt, G, h)

    def subject(self, row: int) -> LinkPair:
        """Return the link and the obstacle of a row of the last tick."""
        return self.pairs[int(self.arrays.found[row])]


@inner
def obstacle_rows(
    robot: RobotArrays, obstacles: ObstacleArrays, dt: float, G: Matrix, h: Vector
) -> None:
    """Write the rows of all points; joint poses are current.

    G, shape (k, nv), gets the negative derivative of each distance; h gets how far a
    point may come nearer in dt seconds, m.
    """
    G[:], h[:] = 0.0, UNBOUNDED
    obstacles.distance[:] = np.inf
    for row in range(h.shape[0]):
        pair, n, c = obstacles.found[row], obstacles.plane[row], obstacles.plane[row, 3]
        if pair < 0:
            continue
        joint, s = obstacles.joint[pair], obstacles.point[row]
        T = robot.pose[joint]
        x = T[9] + T[0] * s[0] + T[3] * s[1] + T[6] * s[2]
        y = T[10] + T[1] * s[0] + T[4] * s[1] + T[7] * s[2]
        z = T[11] + T[2] * s[0] + T[5] * s[1] + T[8] * s[2]
        d = n[0] * x + n[1] * y + n[2] * z - c
        obstacles.distance[row] = d
        left = d - obstacles.margin[pair]
        h[row] = greatest_approach(left, obstacles.rate, obstacles.braking, dt)
        for col in range(G.shape[1]):
            speed = speed_along(robot.jacobian[col], n, x, y, z)
            G[row, col] = -obstacles.moves[joint, col] * speed
