"""Common steps of the URDF and MJCF import: names, checks, inferred groups."""

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from wbc_suite import logs
from wbc_suite.config_files import parse_model
from wbc_suite.errors import DescriptionError, join_first, shortened
from wbc_suite.robot.adopt.cube_hold import servo_of
from wbc_suite.robot.adopt.grippers import Gripper, infer_grippers
from wbc_suite.robot.adopt.limbs import (
    Limb,
    infer_frames,
    infer_limbs,
    infer_ready,
    infer_role,
)
from wbc_suite.robot.adopt.missing_data import (
    ellipsoid,
    estimate_armatures,
    estimate_lifts,
    estimate_masses,
    estimate_motors,
    gyration_fault,
)
from wbc_suite.robot.adopt.soles import level_soles
from wbc_suite.robot.adopt.standing_posture import feet_are_level, standing_legs
from wbc_suite.robot.adopt.wheels import find_wheels
from wbc_suite.robot.adopt.working_posture import working_arms
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Actuator, Frame, Link, rigid_bodies
from wbc_suite.robot.inertia import implausible, nearest_physical, unphysical
from wbc_suite.robot.validation import RESERVED
from wbc_suite.robot.wheel_drive import WHEELS, WheelDrive

LOG = logs.logger(__name__)

LinkFields: TypeAlias = dict[str, Any]  # fields of one `Link`, before validation

MAX_NAME = 70
"""Characters kept of a name in the file; our limit of 80 leaves room for a suffix."""
UNLIMITED_RANGE = 1e4
"""A position limit at least as large, in rad or m, means that there is none."""
CARRIER_MASS, END_MASS = 1e-10, 1e-3
"""Mass in kg of a moving link for which the file has none, if it carries others."""
GYRATION = 0.03  # radius of gyration of such a link, m
FEW_MOTORS = "efforts and armatures are estimated: the file has few or none"
WEAK_LIFTS = "efforts of lifts are estimated: those of the file are below their load"
NO_ARMATURES = "armatures are estimated from efforts: the file has none"
PAD: dict[str, Any] = {
    "friction": (1.0, 0.05, 0.001),
    "condim": 4,
    "solref": (0.004, 1.0),
}
"""Contacts of hands, as those of our own Panda's fingers: with MuJoCo's defaults a cube
turns between two convex hulls until it falls."""
MAX_MESSAGE = 800  # largest number of characters of a list in a message


class NameTable:
    """Assigns names of letters, digits and `_`, unique over links, joints and frames.

    Equal files give equal names.
    """

    def __init__(self) -> None:
        self._taken: set[str] = set(RESERVED)
        self._renamed: list[str] = []

    def take(self, original: str, kind: str) -> str:
        """Return a unique name close to the original; `kind` is a suffix if needed."""
        plain = re.sub(r"[^A-Za-z0-9_]", "_", original)[:MAX_NAME]
        if not re.match(r"[A-Za-z]", plain):
            plain = f"{kind}_{plain.lstrip('_')}".rstrip("_")
        name, number = plain, 1
        while name in self._taken:
            name = f"{plain}_{kind}{number if number > 1 else ''}"
            number += 1
        self._taken.add(name)
        if name != original:
            LOG.info("The %s '%s' is imported as '%s'.", kind, original, name)
            self._renamed.append(f"{kind} '{original}' to '{name}'")
        return name

    def report(self, source: Path) -> None:
        """Log which names are not those of the file."""
        if self._renamed:
            LOG.warning(
                "%s: renamed, since a name has letters, digits and '_', and only one "
                "item has it: %s.",
                *(source, join_first(self._renamed, limit=12)),
            )


def describe_import(
    *,
    name: str,
    source: Path,
    root: dict[str, Any],
    links: Sequence[LinkFields],
    frames: Sequence[dict[str, Any]],
    names: NameTable,
    lines: Mapping[str, str] | None = None,
    meshes: Mapping[str, str] | None = None,
    strict: bool = False,
    slabs: Callable[[str], Sequence[dict[str, Any]]] | None = None,
    **others: Any,
) -> RobotDescription:
    """Check imported links and frames, and infer what the file does not define.

    Groups, end effectors and a `ready` posture are inferred unless `others` has them.
    Inertias that no body can have are replaced by the nearest possible ones with a
    warning, or refused if the import is `strict`. An implausible inertia is only a
    warning, since some meshes may not be read. Messages tell the `lines` of links.
    Names of files of `meshes`, by link, may tell mecanum wheels.
    `slabs` gives the shapes of a link with meshes cut to several hulls: a gripper that
    drops a cube between single hulls takes them if it holds the cube then.

    Raises:
        DescriptionError: If the robot is inconsistent, or unphysical and `strict`.
    """
    names.report(source)
    checked: list[Link] = []
    for fields in _without_chains(links):
        where = f"{source}: link '{fields['name']}'"
        where += (lines or {}).get(fields["name"], "")
        checked.append(parse_model(Link, fields, source=where, error=DescriptionError))
    how: dict[str, Any] = {"source": str(source), "error": DescriptionError}
    roles = [x | {"role": infer_role(x["name"])} for x in frames]
    given = [parse_model(Frame, x, **how) for x in roles]
    driven = {fields["joint"] for fields in others.get("actuators", ())}
    wheeled = find_wheels(
        checked,
        infer_ready(checked),
        root=root,
        take=names.take,
        driven=driven,
        name=name,
        meshes=meshes,
    )
    kinds, wheels = dict[str, str](), ()
    if wheeled is not None:
        checked, kinds, wheels = list(wheeled.links), wheeled.kinds, wheeled.joints
        root = wheeled.root or root
        others |= wheeled.fields(others.get("actuators", ()))
    limbs = infer_limbs(checked, kinds)
    placed = infer_frames(checked, limbs, given, names.take)
    checked = _with_inertias(checked, placed, source, strict=strict)
    actuated = {fields["joint"] for fields in others.get("actuators", ())}
    complete, deviations = _with_motors(checked, placed, actuated, limbs, source)
    keyframes = others.pop("keyframes", {})
    data: dict[str, Any] = {
        "name": NameTable().take(name, "robot"),
        "source": f"imported from {source.name}",
        "root": root if strict else _held(root, checked, source),
        "links": complete,
        "frames": placed,
        "deviations": deviations,
        "groups": _groups(limbs, wheels),
        "keyframes": {"ready": infer_ready(checked)} | keyframes,
    }
    robot = parse_model(RobotDescription, data | others, **how)
    robot = _with_grippers(robot, source, names.take, slabs)
    if wheeled is not None:
        on = "its root is planar" if wheeled.root else "on legs"
        LOG.warning("%s: it drives, %s: %s.", source, on, WheelDrive(robot))
    if "ready" in keyframes:
        if keyframes["ready"] != keyframes.get("home") or feet_are_level(robot):
            return level_soles(robot, given, names.take)
        LOG.warning("%s: the feet in keyframe 'home' are not level; not used.", source)
        robot = _with_ready(robot, lambda robot: infer_ready(robot.links))
    try:
        robot = _with_ready(robot, standing_legs)
        return _with_ready(level_soles(robot, given, names.take), working_arms)
    except ValueError as error:  # of MuJoCo's compiler
        raise DescriptionError(f"{source}: MuJoCo refuses it: {error}") from error


def _groups(limbs: Sequence[Limb], wheels: Sequence[str]) -> dict[str, Sequence[str]]:
    """Return the joints of limbs by name, and those of wheels as their own group."""
    found = {x.name: [j for j in x.joints if j not in wheels] for x in limbs}
    return {n: own for n, own in (found | {WHEELS: wheels}).items() if own}


def _with_motors(
    links: Sequence[Link],
    frames: Sequence[Frame],
    driven: Collection[str],
    limbs: Sequence[Limb],
    source: Path,
) -> tuple[list[Link], tuple[str, ...]]:
    """Return links with estimated motors, lifts and armatures; what was estimated."""
    moving = [limb.joints for limb in limbs if limb.kind in ("arm", "leg", "base")]
    motors = estimate_motors(links, frames, driven, moving)
    lifts = estimate_lifts(motors, driven)
    complete = estimate_armatures(lifts)
    said = [FEW_MOTORS] * (motors != links) + [WEAK_LIFTS] * (lifts != motors)
    for text in said:
        LOG.warning("%s: %s.", source, text)
    return complete, (*said, *[NO_ARMATURES] * (complete != lifts))


def _with_grippers(
    robot: RobotDescription,
    source: Path,
    take: Callable[[str, str], str],
    slabs: Callable[[str], Sequence[dict[str, Any]]] | None,
) -> RobotDescription:
    """Return the robot with the synergies and grasps of its grippers, which open."""
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


def _held(root: LinkFields, links: Sequence[Link], source: Path) -> LinkFields:
    """Return the root, fixed if what should move has no mass."""
    rigid, trunk = rigid_bodies(links), links[0].name
    if root["kind"] == "fixed" or any(x.mass for x in links if rigid[x.name] == trunk):
        return root
    LOG.warning("%s: its root has no mass: '%s' is held fixed.", source, trunk)
    return {"kind": "fixed"} | {k: root[k] for k in ("pos", "quat") if k in root}


def _with_ready(
    robot: RobotDescription, find: Callable[[RobotDescription], dict[str, float]]
) -> RobotDescription:
    """Return the robot with some joints of its posture `ready` changed."""
    ready = robot.keyframes["ready"] | find(robot)
    return robot.model_copy(update={"keyframes": robot.keyframes | {"ready": ready}})


def _without_chains(links: Sequence[LinkFields]) -> Sequence[LinkFields]:
    """Couple joints that follow a follower to the leader at the end of the chain."""
    mimics = {
        fields["joint"]["name"]: fields["joint"]["mimic"]
        for fields in links
        if "mimic" in fields.get("joint", ())
    }
    for name, own in mimics.items():
        seen = {name}
        while own["joint"] in mimics:
            if own["joint"] in seen:
                raise DescriptionError(f"joint '{name}' follows itself in a loop.")
            seen.add(own["joint"])
            leader = mimics[own["joint"]]
            own |= {
                "joint": leader["joint"],
                "ratio": own["ratio"] * leader["ratio"],
                "offset": own["offset"] + own["ratio"] * leader["offset"],
            }
    return links


def _with_inertias(
    links: list[Link], frames: Sequence[Frame], source: Path, *, strict: bool
) -> list[Link]:
    """Return links with masses and inertias that bodies can have."""
    links = links if strict else _filled(links, frames, source)
    links = _with_masses(links, source, strict=strict)
    return _accept_implausible(_physical(links, source, strict=strict), source)


def _filled(links: Sequence[Link], frames: Sequence[Frame], source: Path) -> list[Link]:
    """Estimate masses where most are missing."""
    filled = estimate_masses(links, frames)
    if filled != links:
        LOG.warning(
            "%s: most links have no mass; mended: %.3g kg in all, from the volumes of "
            "their shapes and what the motors hold. Give each an <inertial> to have "
            "others.",
            *(source, sum(link.mass for link in filled)),
        )
    return filled


def _with_masses(links: Sequence[Link], source: Path, *, strict: bool) -> list[Link]:
    """Give moving links without mass a negligible one, or refuse them if `strict`.

    MuJoCo needs a mass on each. One that carries other masses gets `CARRIER_MASS`.
    """
    rigid = rigid_bodies(links)
    heavy = {rigid[link.name] for link in links if link.mass > 0.0}
    empty = [x.name for x in links if x.joint and x.name not in heavy]
    shown = join_first([f"'{name}'" for name in empty], limit=len(links))
    if empty and strict:
        raise DescriptionError(
            f"{source}: the links {shown} move but have no mass. Give each a mass and "
            "an inertia (1e-3 kg and 1e-6 kg m^2 are enough for a dummy), or make its "
            "joint fixed."
        )
    if empty:
        LOG.warning(
            "%s: the links %s move but have no mass; mended: 1e-3 kg for those at the "
            "ends, 1e-10 kg for those that carry others.",
            *(source, shown),
        )
    carrying: set[str | None] = set()
    for link in reversed(links):
        if link.mass > 0.0 or link.name in carrying:
            carrying.add(link.parent)

    def weighted(link: Link) -> Link:
        mass = CARRIER_MASS if link.name in carrying else END_MASS
        own = (mass * GYRATION**2,) * 3 + (0.0,) * 3
        inertia = link.inertia if any(link.inertia) else own
        return link.model_copy(update={"mass": mass, "inertia": inertia})

    return [weighted(link) if link.name in empty else link for link in links]


def _physical(links: Sequence[Link], source: Path, *, strict: bool) -> list[Link]:
    """Correct the inertias that no rigid body can have, or refuse them if `strict`."""
    rigid = rigid_bodies(links)
    turning = {rigid[link.name] for link in links if any(link.inertia)}
    moving = {link.name for link in links if link.joint} - turning
    faults = {
        link.name: "it turns, and its mass has no extent"
        for link in links
        if rigid[link.name] in moving and link.mass > 0.0
    }
    faults |= {link.name: fault for link in links if (fault := unphysical(link))}
    heads = [x for x in links if x.joint or x is links[0]]
    wrong = {x.name: fault for x in heads if (fault := gyration_fault(x))}
    faults |= wrong
    links = [ellipsoid(x) if x.name in wrong else x for x in links]
    shown = "; ".join(f"link '{n}': {fault}" for n, fault in faults.items())
    if faults and strict:
        raise DescriptionError(
            f"{source}: {shortened(shown, MAX_MESSAGE)}. Correct these links in the "
            "file, or leave out --strict to take the nearest possible inertias."
        )
    if faults:
        LOG.warning(
            "%s: %d inertias are mended to the nearest that a body can have: %s.",
            *(source, len(faults), shown),
        )
    return [nearest_physical(x) if x.name in faults else x for x in links]


def _accept_implausible(links: Sequence[Link], source: Path) -> list[Link]:
    """Accept implausible links, and list them in one warning."""
    faults = {link.name: dict(implausible(link)) for link in links}
    lines = [f"link '{n}': {t}" for n, own in faults.items() for t in own.values()]
    if lines:
        shown = shortened("; ".join(lines), MAX_MESSAGE)
        LOG.warning("%s: accepted as given: %s.", source, shown)
    reason = f"as given in {source.name}"
    return [
        link.model_copy(update={"accept": dict.fromkeys(faults[link.name], reason)})
        for link in links
    ]


def with_soles(robot: RobotDescription) -> RobotDescription:
    """Return a free robot whose feet collide: with their visual shapes if need be.

    Without frames of feet these are all links.

    Raises:
        DescriptionError: If it has no shape to stand on.
    """
    rigid = rigid_bodies(robot.links)
    feet = {rigid[frame.link] for frame in robot.frames if frame.role == "foot"}
    standing = [x for x in robot.links if not feet or rigid[x.name] in feet]
    solid = {rigid[link.name] for link in standing if link.collision}
    bare = [x for x in standing if x.visual and rigid[x.name] not in solid]
    if solid >= feet and solid:
        return robot
    if not bare:
        names = ", ".join(sorted(feet)) or "its links"
        raise DescriptionError(
            f"{robot.name}: a free robot stands on its collision shapes, but there are "
            f"neither these nor visual ones on {names}. Meshes that were not found "
            "count as none."
        )
    shown = join_first([f"'{link.name}'" for link in bare])
    LOG.warning("%s: collides with its visual shapes: %s.", robot.name, shown)
    grey = {"color": "grey"}
    update: dict[str, Link] = {}
    for link in bare:
        solid = tuple(shape.model_copy(update=grey) for shape in link.visual)
        update[link.name] = link.model_copy(update={"collision": solid})
    links = tuple(update.get(link.name, link) for link in robot.links)
    return robot.model_copy(update={"links": links})
