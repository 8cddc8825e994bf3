"""Keep links apart and off the floor: which ones, and whether a configuration does."""

import numpy as np

from wbc_suite.control.composite.config import WholeBodyIKConfig
from wbc_suite.control.part.postures import random_posture
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import FloorLimit, SelfCollisionLimit
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.capsules import collision_pairs, enclosing_capsules
from wbc_suite.robot.spheres import spanning_spheres
from wbc_suite.typing import Matrix, Vector

__all__ = ["Clearance", "apart_limits"]

NEIGHBOURS = 1
"""Links with at most this many joints between them are kept apart by joint limits."""

SAMPLES = 100
OFTEN = 0.4
"""Pairs that touch in this part of random configurations enclose too generously."""


def apart_limits(
    robot: RobotDescription, config: WholeBodyIKConfig
) -> list[SelfCollisionLimit | FloorLimit]:
    """Return the rows that keep a robot's links from all that they could touch."""
    limits: list[SelfCollisionLimit | FloorLimit] = []
    if config.limits.self_collision:
        limits.append(_self_collision_limit(robot, config))
    if config.held:
        limits.append(_floor_limit(robot, config))
    return limits


def _floor_limit(robot: RobotDescription, config: WholeBodyIKConfig) -> FloorLimit:
    """Return the rows that keep all but the legs off the floor.

    What leans on the floor takes weight off the feet, which lift, slip, and let the
    robot fall.
    """
    spheres = spanning_spheres(robot)
    for link in _legs(robot, config):
        spheres.pop(link, None)
    return FloorLimit(
        spheres,
        height=config.limits.floor,
        nearest=config.limits.collision_pairs,
        margin=config.limits.collision_distance,
    )


def _legs(robot: RobotDescription, config: WholeBodyIKConfig) -> set[str]:
    """Return the links between the root and what is held."""
    found: set[str] = set()
    for held in config.held:
        link = robot.link(robot.link_of(held.frame))
        while link.parent is not None:
            found.add(link.name)
            link = robot.link(link.parent)
    return found


def _self_collision_limit(
    robot: RobotDescription, config: WholeBodyIKConfig
) -> SelfCollisionLimit:
    """Return the rows that keep a robot's links apart.

    Capsules that touch at the posture enclose too generously, and are left out.
    """
    configuration = Configuration(robot.to_pinocchio())
    pairs = [
        (first, second)
        for first, second in sorted(tuple(sorted(p)) for p in collision_pairs(robot))
        if _joints_between(configuration, first, second) > NEIGHBOURS
    ]
    limit = SelfCollisionLimit(
        enclosing_capsules(robot),
        _seldom_touching(robot, pairs, configuration),
        nearest=config.limits.collision_pairs,
        margin=config.limits.collision_distance,
    )
    limit.bind(configuration)
    name = config.posture.keyframe
    if name in robot.keyframes:
        configuration.update(configuration.model.referenceConfigurations[name])
    limit.drop_touching(configuration)
    return limit


def _seldom_touching(
    robot: RobotDescription,
    pairs: list[tuple[str, str]],
    configuration: Configuration,
) -> list[tuple[str, str]]:
    """Return the pairs that touch in few random configurations."""
    if not pairs:
        return pairs
    nearest = 4 * len(pairs)
    limit = SelfCollisionLimit(
        enclosing_capsules(robot), pairs, nearest=nearest, margin=0.0, influence=1e-4
    )
    limit.bind(configuration)
    G, h = np.zeros((nearest, configuration.nv)), np.zeros(nearest)
    touches = dict.fromkeys(pairs, 0)
    rng = np.random.default_rng(0)
    for _ in range(SAMPLES):
        q = random_posture(configuration.model, configuration.q, rng)
        configuration.update(q)
        limit.rows(configuration, 1.0, G, h)
        rows = np.flatnonzero(limit.distances < 0.0).tolist()
        for a, b in {tuple(sorted(limit.label(row).split(" - "))) for row in rows}:
            touches[a, b] += 1
    return [pair for pair in pairs if touches[pair] <= OFTEN * SAMPLES]


def _joints_between(configuration: Configuration, first: str, second: str) -> int:
    a = {int(i) for i in configuration.support(first)}
    b = {int(i) for i in configuration.support(second)}
    return len(a ^ b)


class Clearance:
    """Tells whether a configuration keeps the distances that the QP's rows keep.

    Args:
        robot: The reduced robot.
        config: Limits.

    Attributes:
        limits: The rows.
    """

    def __init__(self, robot: RobotDescription, config: WholeBodyIKConfig) -> None:
        self._configuration = Configuration(robot.to_pinocchio())
        self.limits = apart_limits(robot, config)
        for limit in self.limits:
            limit.bind(self._configuration)
        rows = max((limit.dim for limit in self.limits), default=0)
        self._G: Matrix = np.zeros((rows, self._configuration.nv))
        self._h: Vector = np.zeros(rows)

    def room(self, q: Vector) -> float:
        """Return how much farther than the margins all links are, m; inf when far."""
        self._configuration.update(q)
        return min((self._room(limit) for limit in self.limits), default=np.inf)

    def is_kept(self, q: Vector) -> bool:
        """Whether all links are farther away than the margins."""
        return self.room(q) > 0.0

    def _room(self, limit: SelfCollisionLimit | FloorLimit) -> float:
        rows = slice(limit.dim)
        limit.rows(self._configuration, 1.0, self._G[rows], self._h[rows])
        return float(limit.distances.min()) - limit.margin
