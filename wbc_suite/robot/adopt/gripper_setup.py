"""Give an imported robot what its grippers need: synergies, servos, stops, contacts."""

from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from typing import Any

from wbc_suite import logs
from wbc_suite.config_files import parse_model
from wbc_suite.errors import DescriptionError
from wbc_suite.robot.adopt.cube_hold import servo_of
from wbc_suite.robot.adopt.grippers import Gripper, infer_grippers
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Actuator, Link

LOG = logs.logger(__name__)

PAD: dict[str, Any] = {
    "friction": (1.0, 0.05, 0.001),
    "condim": 4,
    "solref": (0.004, 1.0),
}
"""Contacts of hands, as those of our own Panda's fingers: with MuJoCo's defaults a cube
turns between two convex hulls until it falls."""


def set_up_grippers(
    robot: RobotDescription,
    source: Path,
    take: Callable[[str, str], str],
    slabs: Callable[[str], Sequence[dict[str, Any]]] | None,
) -> RobotDescription:
    """Return the robot with what moves its grippers, which are open at `ready`.

    Args:
        robot: As far as it is imported.
        source: The file, for messages.
        take: Returns a free name near the given one, for a kind of element.
        slabs: Returns the shapes of a link with meshes cut to several hulls.

    Raises:
        DescriptionError: If MuJoCo refuses the robot.
    """
    found = _grippers(robot, source)
    loose = {name for x in found.values() if not x.held for name in x.links}
    if slabs is not None and loose:
        cut = _with_slabs(robot, loose, slabs)
        better = _grippers(cut, source) if cut != robot else found
        if sum(x.held for x in better.values()) > sum(x.held for x in found.values()):
            robot, found = cut, better
    frames, ready = list(robot.frames), dict(robot.keyframes["ready"])
    for group, own in found.items():
        LOG.info("%s: %s: %s.", source, group, own.reason)
        ready |= own.synergy.open
        if own.tcp is not None:
            name = take(own.tcp.name, "frame")
            frames.append(own.tcp.model_copy(update={"name": name}))
    update = {
        "links": _with_pads(
            _with_stops(robot.links, found.values(), source), found.values()
        ),
        "actuators": _with_servos(robot, found.values()),
        "synergies": {group: (own.synergy,) for group, own in found.items()},
        "frames": tuple(frames),
        "keyframes": robot.keyframes | {"ready": ready},
    }
    return RobotDescription.model_validate(
        {key: getattr(robot, key) for key in RobotDescription.model_fields} | update
    )


def _with_stops(
    links: Sequence[Link], grippers: Iterable[Gripper], source: Path
) -> tuple[Link, ...]:
    """Return links whose jaws without limits end at open and closed, as stops."""
    ends = {
        joint: tuple(sorted((value, own.synergy.closed[joint])))
        for own in grippers
        for joint, value in own.synergy.open.items()
    }

    def stopped(link: Link) -> Link:
        joint = link.joint
        if joint is None or joint.range is not None or joint.name not in ends:
            return link
        LOG.warning(
            "%s: the jaw '%s' has no limits; mended: %.3g to %.3g.",
            *(source, joint.name, *ends[joint.name]),
        )
        update = {"range": ends[joint.name]}
        return link.model_copy(update={"joint": joint.model_copy(update=update)})

    return tuple(map(stopped, links))


def _with_pads(links: Sequence[Link], grippers: Iterable[Gripper]) -> tuple[Link, ...]:
    """Return links of hands with contacts of `PAD` where the file states none."""
    touching = {name for own in grippers for name in own.links}

    def padded(link: Link) -> Link:
        if link.name not in touching:
            return link
        shapes = [
            shape.model_copy(
                update={k: v for k, v in PAD.items() if getattr(shape, k) is None}
            )
            for shape in link.collision
        ]
        return link.model_copy(update={"collision": tuple(shapes)})

    return tuple(map(padded, links))


def _with_servos(
    robot: RobotDescription, grippers: Iterable[Gripper]
) -> tuple[Actuator, ...]:
    """Return actuators with servos for joints of grippers in place of torque motors."""
    driven = {joint for own in grippers for joint in own.synergy.open}
    driven -= {x.joint for x in robot.actuators if x.kind != "motor"}
    kept = [x for x in robot.actuators if x.joint not in driven]
    return (*kept, *(servo_of(x) for x in robot.joints if x.name in driven))


def _grippers(robot: RobotDescription, source: Path) -> dict[str, Gripper]:
    try:
        return infer_grippers(robot)
    except ValueError as error:  # of MuJoCo's compiler
        raise DescriptionError(f"{source}: MuJoCo refuses it: {error}") from error


def _with_slabs(
    robot: RobotDescription,
    names: Collection[str],
    slabs: Callable[[str], Sequence[dict[str, Any]]],
) -> RobotDescription:
    """Return the robot with collision shapes of some links cut to several hulls."""

    def cut(link: Link) -> Link:
        shapes = list(slabs(link.name)) if link.name in names else []
        if len(shapes) <= len(link.collision or link.visual):
            return link
        fields = {"name": link.name, "collision": shapes}
        finer = parse_model(Link, fields, source=robot.name, error=DescriptionError)
        return link.model_copy(update={"collision": finer.collision})

    return robot.model_copy(update={"links": tuple(map(cut, robot.links))})
