"""QP limits that keep links apart and off the floor."""

import numpy as np

from wbc_suite.control.composite.whole_body_config import WholeBodyIKConfig
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.configuration import random_configuration
from wbc_suite.qp import FloorLimit, SelfCollisionLimit
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.collision_capsules import (
    collision_pairs,
    collision_spheres,
    enclosing_capsules,
)

MAX_NEIGHBOUR_JOINTS = 1
"""Links with at most this many joints between them are kept apart by joint limits."""

SAMPLES = 100
MAX_OVERLAP_SHARE = 0.4
"""Pairs that overlap in a greater share of random configurations are left out."""


def distance_limits(
    robot: RobotDescription, config: WholeBodyIKConfig
) -> list[SelfCollisionLimit | FloorLimit]:
    """Return the limits that keep a robot's links apart and off the floor."""
    limits: list[SelfCollisionLimit | FloorLimit] = []
    if config.limits.self_collision:
        limits.append(_self_collision_limit(robot, config))
    if config.held:
        limits.append(_floor_limit(robot, config))
    return limits


def _floor_limit(robot: RobotDescription, config: WholeBodyIKConfig) -> FloorLimit:
    """Return the limit that keeps all links but the legs off the floor.

    Another contact with the floor would take load off the feet, which then slip.
    """
    spheres = collision_spheres(robot)
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
    """Return the limit that keeps a robot's links apart.

    Pairs whose capsules overlap at the posture are left out.
    """
    configuration = Configuration(robot.to_pinocchio())
    pairs = [
        (first, second)
        for first, second in sorted(tuple(sorted(p)) for p in collision_pairs(robot))
        if _joints_between(configuration, first, second) > MAX_NEIGHBOUR_JOINTS
    ]
    limit = SelfCollisionLimit(
        enclosing_capsules(robot),
        _rarely_overlapping(robot, pairs, configuration),
        nearest=config.limits.collision_pairs,
        margin=config.limits.collision_distance,
    )
    limit.bind(configuration)
    name = config.posture.keyframe
    if name in robot.keyframes:
        configuration.update(configuration.model.referenceConfigurations[name])
    limit.drop_touching(configuration)
    return limit


def _rarely_overlapping(
    robot: RobotDescription,
    pairs: list[tuple[str, str]],
    configuration: Configuration,
) -> list[tuple[str, str]]:
    """Return the pairs whose capsules overlap in few random configurations."""
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
        q = random_configuration(configuration.model, configuration.q, rng)
        configuration.update(q)
        limit.rows(configuration, 1.0, G, h)
        rows = np.flatnonzero(limit.distances < 0.0).tolist()
        touching = {limit.subject(row) for row in rows}
        for a, b in {tuple(sorted((x.first, x.second))) for x in touching}:
            touches[a, b] += 1
    return [pair for pair in pairs if touches[pair] <= MAX_OVERLAP_SHARE * SAMPLES]


def _joints_between(configuration: Configuration, first: str, second: str) -> int:
    a = {int(i) for i in configuration.support(first)}
    b = {int(i) for i in configuration.support(second)}
    return len(a ^ b)
