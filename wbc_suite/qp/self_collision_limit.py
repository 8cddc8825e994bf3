"""Keep the robot's links apart from each other."""

from collections.abc import Collection, Iterable, Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from wbc_suite.arguments import check_count, check_number
from wbc_suite.compiling import compiled
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.array_table import ArrayTable
from wbc_suite.qp.capsule_distance import CapsuleField, nearest_pairs
from wbc_suite.qp.limit import RowLimit
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.robot.capsules import EnclosingCapsule
from wbc_suite.typing import Indices, Matrix, Vector

if TYPE_CHECKING:
    from wbc_suite.robot import RobotDescription

__all__ = ["SelfCollisionLimit"]

_APART = 0.2  # m/s, greatest speed of separation where links are too near


class SelfCollisionLimit(RowLimit):
    """Slow the approach of links, and never let them touch.

    For the nearest capsule pairs, with d their distance and n the unit vector from the
    one's nearest point to the other's, the rows are velocity dampers,

        d' = n . (v_a - v_b) >= -rate (d - margin),

    and where d has fallen under the margin, separation at no more than 0.2 m/s. One
    compiled kernel places all capsules, discards pairs by their bounding spheres, and
    measures the rest; the rows follow from the joint Jacobians. Pairs that are far are
    left alone until something has moved far enough to bring them near.

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

    gives_way = 0.1  # m/s: links that start inside each other, 1 cm at the usual rate

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
        self.found: Indices = np.full(self.dim, -1, dtype=np.int64)
        self.distances: Vector = np.full(self.dim, np.inf)

    @classmethod
    def of_robot(
        cls, robot: "RobotDescription", *, nearest: int = 40, margin: float = 0.005
    ) -> "SelfCollisionLimit":
        """Return the limit for a robot's own collision shapes and pairs.

        Capsules enclose generously. Those that overlap in one of the robot's own
        keyframes (without any, in its neutral posture) say nothing about contact, and
        are not kept apart.
        """
        from wbc_suite.robot.capsules import collision_pairs, enclosing_capsules

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
        found = np.full(count, -1, dtype=np.int64)
        distances, normals = np.full(count, np.inf), np.zeros((count, configuration.nv))
        touching = self._nearest(configuration, self.margin, found, distances, normals)
        self._pairs = np.delete(self._pairs, found[:touching], axis=0)
        self.bind(configuration)

    def bind(self, configuration: Configuration) -> None:
        """Resolve links to joints.

        Raises:
            UnknownNameError: If a link is no frame of the model.
        """
        model = configuration.model
        joints: Indices = np.zeros(len(self._capsules), dtype=np.int64)
        ends = np.empty((len(self._capsules), 6))
        for k, capsule in enumerate(self._capsules):
            frame = model.frames[configuration.frame_id(capsule.link)]
            joints[k] = frame.parentJoint
            ends[k, :3] = frame.placement.act(np.asarray(capsule.start))
            ends[k, 3:] = frame.placement.act(np.asarray(capsule.end))
        moves = np.zeros((len(model.joints), configuration.nv))
        for joint in set(joints.tolist()):
            moves[joint, configuration.joint_support(joint)] = 1.0
        f = CapsuleField
        self._arrays = ArrayTable(
            CapsuleField,
            {
                f.JOINTS: joints,
                f.ENDS: ends,
                f.RADII: np.array([c.radius for c in self._capsules], dtype=float),
                f.PAIRS: self._pairs,
                f.MOVES: moves,
                f.NEAR: np.zeros(len(self._pairs), dtype=np.int64),
                f.NEAR_COUNT: np.zeros(1, dtype=np.int64),
                f.NEAR_WITHIN: np.full(1, np.nan),
                f.NEAR_MIDDLES: np.zeros((len(self._capsules), 3)),
            },
        )

    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write the dampers of the nearest pairs, `-n . (J_a - J_b) dq <= ...`."""
        self._nearest(configuration, self.influence, self.found, self.distances, G)
        _dampers(self.distances, self.margin, self.rate * dt, _APART * dt, h)

    def _nearest(
        self,
        configuration: Configuration,
        within: float,
        found: Indices,
        distances: Vector,
        rows: Matrix,
    ) -> int:
        """Write the pairs nearer than a distance; see `nearest_pairs`."""
        return nearest_pairs(
            configuration.placements,
            configuration.joint_jacobians,
            self._arrays.table,
            within,
            found,
            distances,
            rows,
        )

    @property
    def pair_count(self) -> int:
        """Number of capsule pairs that are kept apart."""
        return len(self._pairs)

    @property
    def listed_count(self) -> int:
        """Number of capsule pairs that a tick measures: near when last sought."""
        return int(self._arrays[CapsuleField.NEAR_COUNT][0])

    def label(self, row: int) -> str:
        """Return the two links of a row of the last tick."""
        a, b = (int(k) for k in self._pairs[self.found[row]])
        return f"{self._capsules[a].link} - {self._capsules[b].link}"


@compiled
def _dampers(
    distances: Vector, margin: float, rate: float, apart: float, h: Vector
) -> None:
    """Write how far each pair may approach; endless distances bind nothing."""
    for i in range(h.shape[0]):
        h[i] = min(max(rate * (distances[i] - margin), -apart), UNBOUNDED)


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
