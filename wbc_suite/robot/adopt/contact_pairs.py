"""Pairs of links that need not collide, found by sampling postures."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from wbc_suite import logs
from wbc_suite.errors import join_first
from wbc_suite.robot.adopt.posed_robot import PosedRobot
from wbc_suite.robot.collision_capsules import enclosing_capsules
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Contacts
from wbc_suite.robot.shapes import Capsule, Shape, Sphere

LOG = logs.logger(__name__)

OVERLAP = 1e-3  # smallest penetration in m that counts as an overlap
NEVER_NEARER = 0.01  # m; links that never come nearer never touch
POSTURES = 2000  # random ones; a share of a quarter is known to 0.01 (binomial)
MAX_OVERLAP_SHARE, MAX_FALSE_SHARE = 0.25, 0.2
"""Shares of random postures: in which shapes overlap, and in which capsules do while
the shapes are not near."""
MAX_JOINTS_BETWEEN = 3
"""Largest number of joints between links that are excluded from contact. Links farther
apart, such as an arm and the trunk, overlap because of the posture."""
SHORTEST = 1e-6  # m; shorter capsules are spheres
ENDLESS = np.pi  # rad; range of a joint without one


def exclude_contacts(robot: RobotDescription, source: Path) -> RobotDescription:
    """Return the robot with further pairs excluded from contact, few joints apart.

    These overlap at `ready`: hulls of meshes can reach past the next link, and such
    links would push each other apart. Or they do not come nearer than 1 cm in any of
    2000 random postures, as setup assistants find them, or overlap in more than a
    quarter of them. Links that overlap so often do so by their hulls, not in the
    machine, whose joint limits allow these postures. Controllers keep links apart by
    capsules, which are larger; where only these overlap in many postures, they would
    take room from the arm. The simulator leaves out such a pair as well: an arm that
    touches itself where its controller does not expect it sticks there.
    """
    given = {*map(frozenset, robot.contacts.exclude)}
    solid = sorted(link.name for link in robot.links if link.collision)
    close = {
        frozenset(pair): joints
        for pair in combinations(solid, 2)
        if (joints := _joints_between(robot, *pair)) <= MAX_JOINTS_BETWEEN
        and frozenset(pair) not in given
    }
    posed = PosedRobot(robot)
    (touching,) = posed.contacts(posed.q[posed.places], -OVERLAP)
    at_ready = [pair for pair in close if pair in touching]
    near, overlap = _sampled_contacts(posed, NEVER_NEARER, -OVERLAP)
    (capsules,) = _sampled_contacts(PosedRobot(_of_capsules(robot)), -OVERLAP)
    apart: list[frozenset[str]] = []
    often: list[frozenset[str]] = []
    for pair, joints in close.items():
        if pair in touching or joints < 2:
            continue
        if pair not in near:
            apart.append(pair)
        elif (
            overlap[pair] > MAX_OVERLAP_SHARE * POSTURES
            or capsules[pair] - near[pair] > MAX_FALSE_SHARE * POSTURES
        ):
            often.append(pair)
    _warn(source, at_ready, "these links overlap in the posture ready")
    subject = "these links, or the capsules around them,"
    _warn(source, often, f"{subject} overlap in many random postures")
    found = [(a, b) for a, b in map(sorted, (*at_ready, *apart, *often))]
    contacts = Contacts(exclude=(*robot.contacts.exclude, *found))
    return robot.model_copy(update={"contacts": contacts})


def _warn(source: Path, pairs: Sequence[frozenset[str]], why: str) -> None:
    shown = [" and ".join(f"'{name}'" for name in sorted(pair)) for pair in pairs]
    if shown:
        listed = join_first(shown, limit=12)
        LOG.warning("%s: %s and will not collide: %s.", source, why, listed)


def _of_capsules(robot: RobotDescription) -> RobotDescription:
    """Return the robot with the capsules around its collision shapes in their place."""
    shapes: dict[str, list[Shape]] = {link.name: [] for link in robot.links}
    for c in enclosing_capsules(robot):
        start, end = c.start.tolist(), c.end.tolist()
        ball = {"shape": "sphere", "pos": start, "radius": c.radius}
        long = {"shape": "capsule", "from": start, "to": end, "radius": c.radius}
        is_ball = float(np.linalg.norm(c.end - c.start)) < SHORTEST
        kind, fields = (Sphere, ball) if is_ball else (Capsule, long)
        shapes[c.link].append(kind.model_validate(fields))
    links = tuple(
        link.model_copy(update={"collision": tuple(shapes[link.name])})
        for link in robot.links
    )
    return robot.model_copy(update={"links": links})


def _sampled_contacts(
    posed: PosedRobot, *distances: float
) -> list[Counter[frozenset[str]]]:
    """Return in how many random postures links are nearer than distances, m."""
    rng = np.random.default_rng(0)
    posed.compiled.geom_margin[:] = max(0.0, *distances)
    ranges = [joint.range or (-ENDLESS, ENDLESS) for joint in posed.robot.joints]
    low, high = np.array(ranges).reshape(-1, 2).T
    found = [Counter[frozenset[str]]() for _ in distances]
    for _ in range(POSTURES):
        near = posed.contacts(rng.uniform(low, high), *distances)
        for counter, pairs in zip(found, near, strict=True):
            counter.update(pairs)
    return found


def _joints_between(robot: RobotDescription, first: str, second: str) -> int:
    parent = {link.name: link.parent for link in robot.links}
    moving = {link.name for link in robot.links if link.joint}

    def ancestors(name: str | None) -> Iterator[str]:
        while name is not None:
            yield name
            name = parent[name]

    return len(({*ancestors(first)} ^ {*ancestors(second)}) & moving)
