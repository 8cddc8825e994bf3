"""Rollers of omnidirectional and mecanum wheels that a file models as one body."""

import numpy as np
import pinocchio as pin

from wbc_suite.config_files import parse_model
from wbc_suite.errors import DescriptionError
from wbc_suite.robot.assembly_steps import depth_first
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Joint, Link, Wheel
from wbc_suite.robot.shapes import Cylinder, Sphere
from wbc_suite.robot.wheel_drive import placed, rigid_spheres
from wbc_suite.typing import Vector

COUNT = 16
"""Rollers of a wheel: its height changes by 1.6 % of the radius as it turns."""
GAP = 0.95  # diameter of a roller over the distance of its neighbour
SHARE = 0.02  # mass of a roller over that of its wheel
ROTOR = (
    1e-5  # kg m^2; so that rollers of 1e-6 kg m^2 do not oscillate at a step of 2 ms
)


def with_rollers(robot: RobotDescription) -> RobotDescription:
    """Return the robot with balls on hinges around wheels that have `roller`.

    Balls turn about the axes of the rollers, so they grip along these and roll across.
    A wheel on which links turn already is not changed.
    """
    above = {link.parent for link in robot.links if link.joint is not None}
    wheels = {w.joint: w for w in robot.wheels if w.roller is not None}
    poses = placed(robot.links, robot.keyframes.get("ready", {}))
    links: list[Link] = []
    added: list[str] = []
    for link in robot.links:
        wheel = wheels.get(link.joint.name) if link.joint else None
        if wheel is None or link.joint is None or link.name in above:
            links.append(link)
            continue
        hub, *rollers = _rolling(robot, link, wheel, poses[link.name])
        links += [hub, *rollers]
        added += [roller.name for roller in rollers]
    if not added:
        return robot
    solid = [x.name for x in links if x.collision and x.name not in added]
    pairs = tuple((roller, other) for roller in added for other in solid)
    data = {key: getattr(robot, key) for key in type(robot).model_fields}
    data["links"] = depth_first(tuple(links))
    data["contacts"] = {"exclude": (*robot.contacts.exclude, *pairs)}
    return parse_model(
        RobotDescription, data, source=robot.name, error=DescriptionError
    )


def _rolling(
    robot: RobotDescription, link: Link, wheel: Wheel, pose: pin.SE3
) -> list[Link]:
    """Return a wheel without its tyre, and its rollers, at a pose in the first link."""
    assert link.joint is not None
    assert wheel.roller is not None
    axis = np.asarray(link.joint.axis)
    middle = _middle(robot, link, axis) * axis
    half = GAP * np.sin(np.pi / COUNT)  # radius of a roller over its distance
    away = wheel.radius / (1.0 + half)
    up = pose.rotation.T @ np.array([0.0, 0.0, 1.0])
    ahead = np.cross(axis, up)
    ahead /= np.linalg.norm(ahead)
    grips = np.cos(wheel.roller) * ahead + np.sin(wheel.roller) * np.cross(up, ahead)
    ends = (middle - 0.1 * away * axis, middle + 0.1 * away * axis)
    fields = {"shape": "cylinder", "from": ends[0].tolist(), "to": ends[1].tolist()}
    hub = Cylinder.model_validate(fields | {"radius": 0.5 * away})
    mass, radius = SHARE * link.mass, half * away
    rollers: list[Link] = []
    for k in range(COUNT):
        turn = pin.AngleAxis(2.0 * np.pi * k / COUNT, axis).matrix()
        name = f"{link.name}_roller{k}"
        rollers.append(
            Link(
                name=name,
                parent=link.name,
                pos=_tuple(middle - away * (turn @ (up - (up @ axis) * axis))),
                mass=mass,
                inertia=(*(0.4 * mass * radius**2,) * 3, 0.0, 0.0, 0.0),
                joint=Joint(
                    name=f"{name}_joint",
                    axis=_tuple(turn @ grips),
                    armature=ROTOR,
                    passive=True,
                ),
                collision=(Sphere(shape="sphere", radius=radius),),
            )
        )
    return [link.model_copy(update={"collision": (hub,)}), *rollers]


def _middle(robot: RobotDescription, link: Link, axis: Vector) -> float:
    """Return the middle of a wheel's shapes along its axis, m."""
    found = rigid_spheres(robot.links, "collision")[link.name]
    along = found[:, :3] @ axis
    return float(along.min() + along.max()) / 2.0 if len(found) else 0.0


def _tuple(vector: Vector) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
