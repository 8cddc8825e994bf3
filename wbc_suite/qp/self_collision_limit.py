"""Keep the robot's links apart from each other."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_count, check_number
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.limit import LimitKind, RowLimit
from wbc_suite.qp.part import joined, run_kernel
from wbc_suite.qp.self_collision_rows import (
    CAPSULE,
    PAIR,
    ROW,
    SETTINGS,
    self_collision_rows,
)
from wbc_suite.robot.collision_capsules import (
    EnclosingCapsule,
    collision_pairs,
    enclosing_capsules,
)
from wbc_suite.typing import Indices, Records, Vector

if TYPE_CHECKING:
    from wbc_suite.robot import RobotDescription


@dataclass(frozen=True, slots=True)
class LinkPair:
    """The names of two links of a robot."""

    first: str
    second: str

    def __str__(self) -> str:
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

    Attributes:
        capsules: The capsules.
        placed: `CAPSULE` records; links that the model has rigid may move in them.
        found: Pair of each row of the last tick, nearest first; -1 for none.
        distances: Distance of each row's pair, m; inf for none.

    Raises:
        ConfigError: If a number is out of range.

    Source: Faverjon and Tournassoud (1987), "A Local Based Approach for Path Planning
    of Manipulators With a High Number of Degrees of Freedom", ICRA.
    """

    kernel: ClassVar[Any] = self_collision_rows
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
        self.capsules = tuple(capsules)
        self._pairs = _capsule_pairs(self.capsules, pairs)
        self._model: pin.Model | None = None  # that the arrays belong to

    @classmethod
    def of_robot(
        cls, robot: "RobotDescription", *, nearest: int = 40, margin: float = 0.005
    ) -> "SelfCollisionLimit":
        """Return the limit for a robot's own collision shapes and pairs.

        Capsules enclose generously. Those that overlap in one of the robot's own
        keyframes (without any, in its neutral posture) do not indicate contact, and
        are not kept apart.
        """
        capsules, pairs = enclosing_capsules(robot), collision_pairs(robot)
        limit = cls(capsules, pairs, nearest=nearest, margin=margin)
        model = robot.to_pinocchio()
        for keyframe in robot.keyframes.values() or ({},):
            q = pin.neutral(model)
            for joint, value in keyframe.items():
                q[model.joints[model.getJointId(joint)].idx_q] = value
            limit.drop_touching(Configuration(model, q))
        return limit

    def drop_touching(self, configuration: Configuration) -> None:
        """Leave out the capsule pairs that are nearer than the margin right now."""
        count = len(self._pairs)
        own, (*_, rows) = self._numbers(configuration, count, self.margin)
        G, h = np.zeros((count, configuration.nv)), np.zeros(count)
        run_kernel(self, configuration.robot, own, 1.0, G, h)
        touching = rows["found"][rows["found"] >= 0]
        self._pairs = np.delete(self._pairs, touching, axis=0)
        self._model = None
        self.bind(configuration)

    def bind(self, configuration: Configuration) -> None:
        """Resolve links to joints. Stacks on one model share the numbers.

        Raises:
            UnknownNameError: If a link is no frame of the model.
        """
        if self._model is not configuration.model:
            own, views = self._numbers(configuration, self.dim, self.influence)
            self._own, (self._settings, self.placed, _, rows) = own, views
            self.found, self.distances = rows["found"], rows["distance"]
            self._model = configuration.model

    def _numbers(
        self, configuration: Configuration, rows: int, influence: float
    ) -> tuple[Vector, list[Records]]:
        """Return the kernel's numbers for so many rows, and views of them."""
        count, frames = len(self.capsules), configuration.model.frames
        pairs = len(self._pairs)
        own, views = joined((SETTINGS, 1), (CAPSULE, count), (PAIR, pairs), (ROW, rows))
        settings, placed, of_pairs, of_rows = views
        settings[0] = count, pairs, self.margin, influence, self.rate, -1
        for record, capsule in zip(placed, self.capsules, strict=True):
            frame = frames[configuration.frame_id(capsule.link)]
            ends = np.array([capsule.start, capsule.end])
            record["joint"], record["radius"] = frame.parentJoint, capsule.radius
            record["ends"] = [frame.placement.act(end) for end in ends]
        of_pairs["first"], of_pairs["second"] = self._pairs.T
        of_rows["found"], of_rows["distance"] = -1, np.inf
        return own, views

    def reset(self) -> None:
        """Discard the list of near pairs."""
        self._settings["listed"] = -1

    @property
    def pair_count(self) -> int:
        """Number of capsule pairs that are kept apart."""
        return len(self._pairs)

    @property
    def listed_count(self) -> int:
        """Number of capsule pairs near enough to be measured at the last tick."""
        return int(self._settings["listed"][0])

    def own(self, configuration: Configuration) -> Vector:
        """Return the kernel's numbers."""
        return self._own

    def subject(self, row: int) -> LinkPair:
        """Return the two links of a row of the last tick."""
        a, b = (int(k) for k in self._pairs[self.found[row]])
        return LinkPair(self.capsules[a].link, self.capsules[b].link)


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
