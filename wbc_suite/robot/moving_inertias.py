"""Inertias of links for engines in which each moving body needs a mass."""

import pinocchio as pin

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import rigid_bodies
from wbc_suite.robot.inertia import inertia_of
from wbc_suite.robot.poses import poses_in_rigid_bodies


def moving_inertias(robot: RobotDescription) -> dict[str, pin.Inertia]:
    """Return the inertias of the links in their axes.

    MuJoCo needs mass on each moving body: one without gets that of links fixed to it.
    """
    inertias = {link.name: inertia_of(link) for link in robot.links}
    rigid = rigid_bodies(robot.links)
    placement = poses_in_rigid_bodies(robot.links)
    for link in robot.links:
        owner = rigid[link.name]
        if owner == link.name:
            continue
        moves = owner != robot.links[0].name or robot.root.kind != "fixed"
        light = robot.link(owner).mass == 0.0 or link.mass == 0.0
        if moves and light and any((link.mass, *link.inertia)):
            inertias[owner] += placement[link.name].act(inertias[link.name])
            inertias[link.name] = pin.Inertia.Zero()
    return inertias
