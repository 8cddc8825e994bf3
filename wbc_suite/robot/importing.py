"""Common steps of the URDF and MJCF import: names, checks, inferred groups."""

import logging
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import mujoco

from wbc_suite.errors import DescriptionError, join_first, shortened
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Frame, Link, rigid_bodies
from wbc_suite.robot.group_inference import (
    infer_frames,
    infer_limbs,
    infer_ready,
    infer_role,
)
from wbc_suite.robot.inertia import implausible, nearest_physical, unphysical
from wbc_suite.robot.standing_posture import standing_legs
from wbc_suite.robot.validation import RESERVED
from wbc_suite.tomlfile import parse_model

LOG = logging.getLogger(__name__)

LinkFields: TypeAlias = dict[str, Any]  # fields of one `Link`, before validation

MAX_NAME = 70
"""Characters kept of a name in the file; our limit of 80 leaves room for a suffix."""
OVERLAP = 1e-3  # smallest penetration in m that counts as an overlap
MAX_JOINTS_BETWEEN = 3
"""Largest number of joints between overlapping links that are excluded from contact.
Links farther apart, such as an arm and the trunk, overlap because of the posture."""
MAX_MESSAGE = 800  # largest number of characters of a list in a message


class NameTable:
    """Assigns names of letters, digits and `_`, unique over links, joints and frames.

    Equal files give equal names.
    """

    def __init__(self) -> None:
        self._taken: set[str] = set(RESERVED)

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
        return name


def describe_import(
    *,
    name: str,
    source: Path,
    root: dict[str, Any],
    links: Sequence[LinkFields],
    frames: Sequence[dict[str, Any]],
    names: NameTable,
    mend_inertias: bool = False,
    **others: Any,
) -> RobotDescription:
    """Check imported links and frames, and infer what the file does not define.

    Groups, end effectors and a `ready` posture are inferred unless `others` has them.
    An implausible inertia is only a warning, since some meshes may not be read.

    Raises:
        DescriptionError: If the robot is inconsistent or unphysical.
    """
    checked: list[Link] = []
    for fields in _without_chains(links):
        where = f"{source}: link '{fields['name']}'"
        checked.append(parse_model(Link, fields, source=where, error=DescriptionError))
    _check_masses(checked, source)
    checked = _physical(checked, source, mend=mend_inertias)
    checked = _accept_implausible(checked, source)
    given = [
        parse_model(
            Frame,
            frame | {"role": infer_role(frame["name"])},
            source=str(source),
            error=DescriptionError,
        )
        for frame in frames
    ]
    limbs = infer_limbs(checked)
    keyframes = others.pop("keyframes", {})
    data: dict[str, Any] = {
        "name": NameTable().take(name, "robot"),
        "source": f"imported from {source.name}",
        "root": root,
        "links": checked,
        "frames": infer_frames(checked, limbs, given, names),
        "groups": {limb.name: limb.joints for limb in limbs if limb.joints},
        "keyframes": {"ready": infer_ready(checked)} | keyframes,
    }
    robot = parse_model(
        RobotDescription, data | others, source=str(source), error=DescriptionError
    )
    if "ready" in keyframes:
        return robot
    ready = robot.keyframes["ready"] | standing_legs(robot)
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


def _check_masses(links: Sequence[Link], source: Path) -> None:
    """Refuse moving links without mass, with advice for the file."""
    rigid = rigid_bodies(links)
    heavy = {rigid[link.name] for link in links if link.mass > 0.0}
    empty = [f"'{x.name}'" for x in links if x.joint and x.name not in heavy]
    if empty:
        raise DescriptionError(
            f"{source}: the links {join_first(empty)} move but have no mass. Give each "
            "a mass and an inertia (1e-3 kg and 1e-6 kg m^2 are enough for a dummy), "
            "or make its joint fixed."
        )


def _physical(links: Sequence[Link], source: Path, *, mend: bool) -> list[Link]:
    """Refuse or correct the inertias that no rigid body can have."""
    faults = {link.name: fault for link in links if (fault := unphysical(link))}
    if faults and not mend:
        shown = "; ".join(f"link '{n}': {fault}" for n, fault in faults.items())
        raise DescriptionError(
            f"{source}: {shortened(shown, MAX_MESSAGE)}. Correct these links in the "
            "file, or take the nearest physical tensors: wbc-suite export FILE "
            "--mend-inertias --to toml, or read_urdf(path, mend_inertias=True)."
        )
    for name, fault in faults.items():
        LOG.warning("%s: link '%s': %s; corrected.", source, name, fault)
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


def overlapping_links(robot: RobotDescription) -> tuple[tuple[str, str], ...]:
    """Return pairs of links that overlap in the posture `ready`, few joints apart.

    Hulls of meshes can reach past the next link; such links would push each other
    apart.
    """
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    contacts = data.contact
    names = {model.body(link.name).id: link.name for link in robot.links}
    deep = contacts.geom[contacts.dist < -OVERLAP]
    pairs = {tuple(sorted(pair)) for pair in model.geom_bodyid[deep].tolist()}
    return tuple(
        (names[first], names[second])
        for first, second in sorted(pairs)
        if _joints_between(robot, names[first], names[second]) <= MAX_JOINTS_BETWEEN
    )


def _joints_between(robot: RobotDescription, first: str, second: str) -> int:
    parent = {link.name: link.parent for link in robot.links}
    moving = {link.name for link in robot.links if link.joint}

    def ancestors(name: str | None) -> Iterator[str]:
        while name is not None:
            yield name
            name = parent[name]

    return len(({*ancestors(first)} ^ {*ancestors(second)}) & moving)
