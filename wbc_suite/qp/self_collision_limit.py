"""Keep the robot's links apart from each other."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_count, check_number
from wbc_suite.compiling import as_argument, compiled
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays, compute_joint_poses
from wbc_suite.qp.capsule_distance import CapsuleArrays, nearest_pairs
from wbc_suite.qp.kernel import Kernel
from wbc_suite.qp.limit import LimitKind, RowLimit
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.robot.collision_capsules import EnclosingCapsule
from wbc_suite.typing import Indices, Matrix, Vector

if TYPE_CHECKING:
    from wbc_suite.robot import RobotDescription

_SEPARATION = 0.2
"""m/s, greatest speed of separation of links that are too near."""


@dataclass(frozen=True, slots=True)
class LinkPair:
    """Two links of a robot.

    Attributes:
        first: Name of the first link.
        second: Name of the second link.
    """

    first: str
    second: str

    def __str__(self) -> str:
        """Return both names: "forearm - torso"."""
        return f"{self.first} - {self.second}"


class SelfCollisionLimit(RowLimit):
    """Slow the approach of links, and never let them touch.

    For the nearest capsule pairs, with d their distance and n the unit vector from the
    one's nearest point to the other's, the rows are velocity dampers,

        d' = n . (v_a - v_b) >= -rate (d - margin),

    and where d has fallen under the margin, separation at no more than 0.2 m/s. One
    compiled kernel places all capsules, discards pairs by their bounding spheres, and
    measures the rest; the rows follow from the joint Jacobians.

    Args:
        capsules: Capsules on the robot's links; link names are frames of the model.
        pairs: Pairs of links that must stay apart.
        nearest: Number of rows: how many capsule pairs a tick considers.
        margin: Distance that is kept, m.
        influence: Pairs further apart than this are left out, m.
        rate: Approach speed per distance left, 1/s.

    Raises:
        ConfigError: If a number is out of range.

    Source: Faverjon and Tournassoud (1987), "A Local Based Approach for Path Planning
    of Manipulators With a High Number of Degrees of Freedom", ICRA.
    """

    kernel: ClassVar[Kernel] = Kernel.SELF_COLLISION
    kind = LimitKind.SELF_COLLISION
    relax_speed = 0.1  # m/s: links that start inside each other, 1 cm at the usual rate

    def __init__(
        self,
        capsules: Sequence[EnclosingCapsule],
        pairs: Iterable[Collection[str]],
        *,
        nearest: int = 40,
        margin: float = 0.005,
        influence: float = 0.1,
        rate: float = 10.0,
    ) -> None:
        name = "SelfCollisionLimit"
        self.dim = check_count(f"{name}: nearest", nearest, least=1)
        self.margin = check_number(f"{name}: margin", margin, least=0.0)
        what = f"{name}: influence, more than the margin,"
        self.influence = check_number(what, influence, above=self.margin)
        self.rate = check_number(f"{name}: rate", rate, above=0.0)
        self._capsules = tuple(capsules)
        self._pairs = _capsule_pairs(self._capsules, pairs)
        self._model: pin.Model | None = None  # that the arrays belong to
        self.rates: Vector = np.array([self.margin, self.rate])

    @classmethod
    def of_robot(
        cls, robot: "RobotDescription", *, nearest: int = 40, margin: float = 0.005
    ) -> "SelfCollisionLimit":
        """Return the limit for a robot's own collision shapes and pairs.

        Capsules enclose generously. Those that overlap in one of the robot's own
        keyframes (without any, in its neutral posture) do not indicate contact, and
        are not kept apart.
        """
        from wbc_suite.robot.collision_capsules import (
            collision_pairs,
            enclosing_capsules,
        )

        limit = cls(
            enclosing_capsules(robot),
            collision_pairs(robot),
            nearest=nearest,
            margin=margin,
        )
        configuration = Configuration(robot.to_pinocchio())
        limit.bind(configuration)
        rest = configuration.q.copy()
        for keyframe in robot.keyframes.values() or ({},):
            q = rest.copy()
            for joint, value in keyframe.items():
                q[configuration.model.joints[configuration.joint_id(joint)].idx_q] = (
                    value
                )
            configuration.update(q)
            limit.drop_touching(configuration)
        return limit

    def drop_touching(self, configuration: Configuration) -> None:
        """Leave out the capsule pairs that are nearer than the margin right now."""
        count = len(self._pairs)
        arrays = self._make_arrays(configuration, rows=count, influence=self.margin)
        compute_joint_poses(configuration.robot)
        G = np.zeros((count, configuration.nv))
        touching = nearest_pairs(configuration.robot, as_argument(arrays), G)
        self._pairs = np.delete(self._pairs, arrays.found[:touching], axis=0)
        self._model = None
        self.bind(configuration)

    def bind(self, configuration: Configuration) -> None:
        """Resolve links to joints. Stacks on one model share the arrays.

        Raises:
            UnknownNameError: If a link is no frame of the model.
        """
        if self._model is not configuration.model:
            rows, influence = self.dim, self.influence
            self.arrays = self._make_arrays(
                configuration, rows=rows, influence=influence
            )
            self.argument = as_argument(self.arrays)
            self._model = configuration.model

    def _make_arrays(
        self, configuration: Configuration, *, rows: int, influence: float
    ) -> CapsuleArrays:
        model, count = configuration.model, len(self._capsules)
        joint, ends = np.zeros(count, dtype=np.int64), np.empty((count, 6))
        for k, capsule in enumerate(self._capsules):
            frame = model.frames[configuration.frame_id(capsule.link)]
            joint[k] = frame.parentJoint
            ends[k, :3] = frame.placement.act(np.asarray(capsule.start))
            ends[k, 3:] = frame.placement.act(np.asarray(capsule.end))
        moves = np.zeros((len(model.joints), configuration.nv))
        for j in set(joint.tolist()):
            moves[j, configuration.joint_support(j)] = 1.0
        return CapsuleArrays(
            joint=joint,
            ends=ends,
            radius=np.array([c.radius for c in self._capsules], dtype=np.float64),
            pairs=self._pairs.ravel().copy(),
            moves=moves,
            influence=influence,
            world=np.zeros((count, 2, 3)),
            middle=np.zeros((count, 3)),
            reach=np.zeros(count),
            listed=np.zeros(len(self._pairs), dtype=np.int64),
            listed_count=np.full(1, -1, dtype=np.int64),
            listed_middle=np.zeros((count, 3)),
            found=np.full(rows, -1, dtype=np.int64),
            distance=np.full(rows, np.inf),
        )

    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write the dampers of the nearest pairs, `-n . (J_a - J_b) dq <= ...`."""
        robot = configuration.robot
        compute_joint_poses(robot)
        self_collision_rows(robot, self.argument, self.rates, dt, G, h)

    def reset(self) -> None:
        """Discard the list of near pairs."""
        self.arrays.listed_count[0] = -1

    @property
    def found(self) -> Indices:
        """Pair of each row of the last tick, nearest first; -1 where there is none."""
        return self.arrays.found

    @property
    def distances(self) -> Vector:
        """Distance of each row's pair at the last tick, m; inf where there is none."""
        return self.arrays.distance

    @property
    def pair_count(self) -> int:
        """Number of capsule pairs that are kept apart."""
        return len(self._pairs)

    @property
    def listed_count(self) -> int:
        """Number of capsule pairs near enough to be measured at the last tick."""
        return int(self.arrays.listed_count[0])

    def subject(self, row: int) -> LinkPair:
        """Return the two links of a row of the last tick."""
        a, b = (int(k) for k in self._pairs[self.found[row]])
        return LinkPair(self._capsules[a].link, self._capsules[b].link)


@compiled
def self_collision_rows(
    robot: RobotArrays,
    capsules: CapsuleArrays,
    rates: Vector,
    dt: float,
    G: Matrix,
    h: Vector,
) -> None:
    """Write the velocity dampers of the nearest pairs.

    Args:
        robot: The robot; joint poses are current.
        capsules: The capsules, whose k nearest pairs have a row.
        rates: Distance that is kept, m, and approach speed per distance left, 1/s.
        dt: Step, s.
        G: Output, shape (k, nv).
        h: Output, how far each pair may approach, m, shape (k,).
    """
    nearest_pairs(robot, capsules, G)
    for row in range(h.shape[0]):
        speed = rates[1] * (capsules.distance[row] - rates[0])
        h[row] = min(max(speed, -_SEPARATION) * dt, UNBOUNDED)


def _capsule_pairs(
    capsules: Sequence[EnclosingCapsule], pairs: Iterable[Collection[str]]
) -> Indices:
    """Return the index pairs of capsules whose links are a pair, shape (n, 2)."""
    of_link: dict[str, list[int]] = {}
    for k, capsule in enumerate(capsules):
        of_link.setdefault(capsule.link, []).append(k)
    found: list[tuple[int, int]] = []
    for a, b in sorted(tuple(sorted(pair)) for pair in pairs):
        found += product(of_link.get(a, ()), of_link.get(b, ()))
    return np.array(found, dtype=np.int64).reshape(len(found), 2)
