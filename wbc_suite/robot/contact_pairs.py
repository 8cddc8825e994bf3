"""Find pairs of links that need not collide, by sampling postures."""

from collections import Counter
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import mujoco
import numpy as np

from wbc_suite import logs
from wbc_suite.errors import join_first
from wbc_suite.robot.collision_capsules import enclosing_capsules
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Contacts
from wbc_suite.robot.shapes import Capsule, Shape, Sphere

LOG = logs.logger(__name__)

OVERLAP = 1e-3  # smallest penetration in m that counts as an overlap
NEVER_NEARER = 0.01  # m; links that never come nearer never touch
POSTURES = 2000
MAX_OVERLAP_SHARE, MAX_FALSE_SHARE = 0.25, 0.2
"""Shares of random postures: in which shapes overlap, and in which capsules do while
the shapes are not near."""
MAX_JOINTS_BETWEEN = 3
"""Largest number of joints between links that are excluded from contact. Links farther
apart, such as an arm and the trunk, overlap because of the posture."""
SHORTEST = 1e-6  # m; shorter capsules are spheres
ENDLESS = np.pi  # rad; range of a joint without one
Pair = tuple[str, str]


def exclude_by_sampling(robot: RobotDescription, source: Path) -> RobotDescription:
    """Return the robot with further pairs excluded from contact, few joints apart.

    These do not come nearer than 1 cm in any of 2000 random postures, as setup
    assistants find them, or overlap in more than a quarter of them. Links that overlap
    so often do so by their hulls, not in the machine, whose joint limits allow these
    postures. Controllers keep links apart by capsules, which are larger; where
    only these overlap in many postures, they would take room from the arm. The
    simulator leaves out such a pair as well: an arm that touches itself where its
    controller does not expect it sticks there.
    """
    near, overlap = _sampled_contacts(robot, NEVER_NEARER, -OVERLAP)
    (capsules,) = _sampled_contacts(_of_capsules(robot), -OVERLAP)
    excluded = {*map(frozenset, robot.contacts.exclude)}
    solid = sorted(link.name for link in robot.links if link.collision)
    close = [
        pair
        for pair in combinations(solid, 2)
        if frozenset(pair) not in excluded
        and 2 <= _joints_between(robot, *pair) <= MAX_JOINTS_BETWEEN
    ]
    often = [
        pair
        for pair in close
        if overlap[pair] > MAX_OVERLAP_SHARE * POSTURES
        or capsules[pair] - near[pair] > MAX_FALSE_SHARE * POSTURES
    ]
    if often:
        shown = [f"'{first}' and '{second}'" for first, second in often]
        LOG.warning(
            "%s: these links, or the capsules around them, overlap in many random "
            "postures and will not collide: %s.",
            *(source, join_first(shown, limit=12)),
        )
    apart = [pair for pair in close if pair not in near]
    exclude = (*robot.contacts.exclude, *apart, *often)
    return robot.model_copy(update={"contacts": Contacts(exclude=exclude)})


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
    robot: RobotDescription, *distances: float
) -> list[Counter[Pair]]:
    """Return in how many random postures sorted pairs are nearer than distances, m."""
    m = robot.to_mjspec().compile()
    data, rng = mujoco.MjData(m), np.random.default_rng(0)
    m.geom_margin[:] = max(0.0, *distances)
    names = {m.body(link.name).id: link.name for link in robot.links}
    index = [m.joint(joint.name).qposadr[0] for joint in robot.joints]
    ranges = [joint.range or (-ENDLESS, ENDLESS) for joint in robot.joints]
    low, high = np.array(ranges).reshape(-1, 2).T
    found = [Counter[Pair]() for _ in distances]
    for _ in range(POSTURES):
        data.qpos[index] = rng.uniform(low, high)
        contacts(m, data)
        for counter, distance in zip(found, distances, strict=True):
            counter.update(_named(_contacts_nearer(m, data, distance), names))
    return found


def _named(pairs: set[tuple[int, int]], names: dict[int, str]) -> Iterator[Pair]:
    for first, second in pairs:
        a, b = sorted((names[first], names[second]))
        yield a, b


def exclude_overlapping(robot: RobotDescription, source: Path) -> RobotDescription:
    """Return the robot with the pairs of `overlapping_links` excluded from contact."""
    pairs = overlapping_links(robot)
    if not pairs:
        return robot
    shown = [f"'{first}' and '{second}'" for first, second in pairs]
    LOG.warning(
        "%s: these links overlap in the posture ready and will not collide: %s.",
        *(source, join_first(shown, limit=12)),
    )
    exclude = (*robot.contacts.exclude, *pairs)
    return robot.model_copy(update={"contacts": Contacts(exclude=exclude)})


def overlapping_links(robot: RobotDescription) -> tuple[Pair, ...]:
    """Return pairs of links that overlap in the posture `ready`, few joints apart.

    Hulls of meshes can reach past the next link; such links would push each other
    apart.
    """
    m = robot.to_mjspec().compile()
    data = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, data, m.key("ready").id)
    names = {m.body(link.name).id: link.name for link in robot.links}
    return tuple(
        (names[first], names[second])
        for first, second in sorted(contacts(m, data, -OVERLAP))
        if _joints_between(robot, names[first], names[second]) <= MAX_JOINTS_BETWEEN
    )


def contacts(
    m: mujoco.MjModel, data: mujoco.MjData, nearer: float = np.inf
) -> set[tuple[int, int]]:
    """Return the bodies, by number, that are nearer than a distance, m, at `qpos`."""
    mujoco.mj_kinematics(m, data)
    mujoco.mj_comPos(m, data)
    mujoco.mj_collision(m, data)
    return _contacts_nearer(m, data, nearer)


def _contacts_nearer(
    m: mujoco.MjModel, data: mujoco.MjData, nearer: float
) -> set[tuple[int, int]]:
    deep = data.contact.geom[data.contact.dist < nearer]
    pairs = np.sort(m.geom_bodyid[deep].reshape(-1, 2), axis=1)
    return {(int(first), int(second)) for first, second in pairs}


def _joints_between(robot: RobotDescription, first: str, second: str) -> int:
    parent = {link.name: link.parent for link in robot.links}
    moving = {link.name for link in robot.links if link.joint}

    def ancestors(name: str | None) -> Iterator[str]:
        while name is not None:
            yield name
            name = parent[name]

    return len(({*ancestors(first)} ^ {*ancestors(second)}) & moving)
