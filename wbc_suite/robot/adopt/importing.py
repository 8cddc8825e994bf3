"""Common steps of the URDF and MJCF import: names, checks, inferred groups."""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from wbc_suite import logs
from wbc_suite.config_files import parse_model
from wbc_suite.errors import DescriptionError, join_first
from wbc_suite.robot.adopt.gripper_setup import set_up_grippers
from wbc_suite.robot.adopt.limbs import (
    Limb,
    infer_frames,
    infer_limbs,
    infer_ready,
    infer_role,
)
from wbc_suite.robot.adopt.mended_inertias import mend_inertias
from wbc_suite.robot.adopt.missing_data import (
    estimate_armatures,
    estimate_lifts,
    estimate_motors,
)
from wbc_suite.robot.adopt.soles import level_soles
from wbc_suite.robot.adopt.standing_posture import feet_are_level, standing_legs
from wbc_suite.robot.adopt.wheels import find_wheels
from wbc_suite.robot.adopt.working_posture import working_arms
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Frame, Link, rigid_bodies
from wbc_suite.robot.validation import RESERVED
from wbc_suite.robot.wheel_drive import WHEELS, WheelDrive

LOG = logs.logger(__name__)

LinkFields: TypeAlias = dict[str, Any]  # fields of one `Link`, before validation

MAX_NAME = 70
"""Characters kept of a name in the file; our limit of 80 leaves room for a suffix."""
UNLIMITED_RANGE = 1e4
"""A position limit at least as large, in rad or m, means that there is none."""
FEW_MOTORS = "efforts and armatures are estimated: the file has few or none"
WEAK_LIFTS = "efforts of lifts are estimated: those of the file are below their load"
NO_ARMATURES = "armatures are estimated from efforts: the file has none"


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
    checked = mend_inertias(checked, placed, source, strict=strict)
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
    robot = set_up_grippers(robot, source, names.take, slabs)
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
