"""Find links that stand in each other because shapes are coarser than the machine."""

from collections.abc import Iterator

import mujoco

from wbc_suite.robot.description import RobotDescription

__all__ = ["overlapping_neighbours"]

DEPTH = 1e-3
"""m; shapes that only touch are meant to."""

BETWEEN = 3
"""Joints between two links, at most: an arm in the trunk stands there by its posture,
and can leave it."""


def overlapping_neighbours(robot: RobotDescription) -> tuple[tuple[str, str], ...]:
    """Return pairs of links that overlap in the posture `ready`, few joints apart.

    Hulls of meshes, and shapes drawn with a margin, reach past the next link into the
    one after. In a simulation, these would push each other for ever.
    """
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    contacts = data.contact
    names = {model.body(link.name).id: link.name for link in robot.links}
    deep = contacts.geom[contacts.dist < -DEPTH]
    pairs = {tuple(sorted(pair)) for pair in model.geom_bodyid[deep].tolist()}
    return tuple(
        (names[first], names[second])
        for first, second in sorted(pairs)
        if _joints_between(robot, names[first], names[second]) <= BETWEEN
    )


def _joints_between(robot: RobotDescription, first: str, second: str) -> int:
    above = {link.name: link.parent for link in robot.links}
    moving = {link.name for link in robot.links if link.joint}

    def ancestry(name: str | None) -> Iterator[str]:
        while name is not None:
            yield name
            name = above[name]

    apart = {*ancestry(first)} ^ {*ancestry(second)}
    return len(apart & moving)
