"""What URDF and MJCF import share: from plain fields to a checked description."""

import logging
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from wbc_suite.errors import DescriptionError
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.guessing import (
    guess_frames,
    guess_limbs,
    guess_ready,
    guess_role,
)
from wbc_suite.robot.naming import NameTable
from wbc_suite.robot.parts import Frame, Link
from wbc_suite.robot.standing import standing_legs
from wbc_suite.robot.validation import (
    implausible,
    inertia_matrix,
    rigid_bodies,
    unphysical,
)
from wbc_suite.tomlfile import parse_model
from wbc_suite.typing import Matrix

__all__ = ["LinkFields", "describe_import", "inertia_fields", "shortened"]

LOG = logging.getLogger(__name__)

SMALLEST = 1e-3
"""Radius of gyration in m below which a mended inertia does not go."""

LinkFields: TypeAlias = dict[str, Any]
"""Fields of one `Link`, before validation."""


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
    """Check imported links and frames, and add what the file does not say.

    Groups, end effectors and a `ready` posture are guessed where `others` has none.
    An implausible centre of mass or inertia is a warning here and not an error, since
    meshes that could not be read leave the shapes incomplete.

    Raises:
        DescriptionError: If the robot contradicts itself or physics.
    """
    checked = [_link(fields, source) for fields in _without_chains(links)]
    _check_masses(checked, source)
    checked = _physical(checked, source, mend=mend_inertias)
    checked = _accepted(checked, source)
    given = [
        parse_model(
            Frame,
            frame | {"role": guess_role(frame["name"])},
            source=str(source),
            error=DescriptionError,
        )
        for frame in frames
    ]
    limbs = guess_limbs(checked)
    keyframes = others.pop("keyframes", {})
    data: dict[str, Any] = {
        "name": _robot_name(name),
        "source": f"imported from {source.name}",
        "root": root,
        "links": checked,
        "frames": guess_frames(checked, limbs, given, names),
        "groups": {limb.name: limb.joints for limb in limbs if limb.joints},
        "keyframes": {"ready": guess_ready(checked)} | keyframes,
    }
    robot = parse_model(
        RobotDescription, data | others, source=str(source), error=DescriptionError
    )
    return robot if "ready" in keyframes else _on_bent_legs(robot)


def _on_bent_legs(robot: RobotDescription) -> RobotDescription:
    ready = robot.keyframes["ready"] | standing_legs(robot)
    return robot.model_copy(update={"keyframes": robot.keyframes | {"ready": ready}})


def _robot_name(name: str) -> str:
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return plain if re.match(r"[A-Za-z]", plain) else f"robot_{plain}".rstrip("_")


def _link(fields: LinkFields, source: Path) -> Link:
    where = f"{source}: link '{fields['name']}'"
    return parse_model(Link, fields, source=where, error=DescriptionError)


def _accepted(links: Sequence[Link], source: Path) -> list[Link]:
    """Accept what is implausible but possible, and tell it in one warning."""
    faults = {link.name: dict(implausible(link)) for link in links}
    told = [f"link '{n}': {text}" for n, own in faults.items() for text in own.values()]
    if told:
        LOG.warning("%s: taken as it is: %s.", source, shortened("; ".join(told)))
    reason = f"as it was in {source.name}"
    return [
        link.model_copy(update={"accept": dict.fromkeys(faults[link.name], reason)})
        for link in links
    ]


def _without_chains(links: Sequence[LinkFields]) -> Sequence[LinkFields]:
    """Let joints that follow a follower follow its leader."""
    mimics = {
        fields["joint"]["name"]: fields["joint"]["mimic"]
        for fields in links
        if "mimic" in fields.get("joint", ())
    }
    for name, own in mimics.items():
        seen = {name}
        while own["joint"] in mimics:
            if own["joint"] in seen:
                raise DescriptionError(f"joint '{name}' follows itself in a circle.")
            seen.add(own["joint"])
            leader = mimics[own["joint"]]
            own |= {
                "joint": leader["joint"],
                "ratio": own["ratio"] * leader["ratio"],
                "offset": own["offset"] + own["ratio"] * leader["offset"],
            }
    return links


def _physical(links: Sequence[Link], source: Path, *, mend: bool) -> list[Link]:
    """Refuse or mend the inertias that no body has."""
    faults = {link.name: fault for link in links if (fault := unphysical(link))}
    if faults and not mend:
        shown = "; ".join(f"link '{n}': {fault}" for n, fault in faults.items())
        raise DescriptionError(
            f"{source}: {shortened(shown)}. Mend these links in the file, or take the "
            "nearest tensors that a body can have: wbc-suite export FILE "
            "--mend-inertias --to toml, or read_urdf(path, mend_inertias=True)."
        )
    for name, fault in faults.items():
        LOG.warning("%s: link '%s': %s; mended.", source, name, fault)
    return [_mended(link) if link.name in faults else link for link in links]


def shortened(text: str) -> str:
    """Return a message's list, cut where nobody would read on."""
    return text if len(text) <= 800 else text[:800] + " ..."


def _mended(link: Link) -> Link:
    """Return the link with the nearest physical inertia.

    An inertia I is physical when the second moments of mass S = tr(I)/2 - I are
    positive: their eigenvalues are raised to that of a body of 1 mm at least.

    Source: Wensing, Kim, Slotine (2018), "Linear matrix inequalities for physically
    consistent inertial parameter identification", RA-L 3(1).
    """
    inertia = inertia_matrix(link.inertia)
    moments, axes = np.linalg.eigh(np.trace(inertia) / 2 * np.eye(3) - inertia)
    raised = np.maximum(moments, link.mass * SMALLEST**2)
    second = (axes * raised) @ axes.T
    fields = inertia_fields(np.trace(second) * np.eye(3) - second)
    return link.model_copy(update={"inertia": fields})


def _check_masses(links: Sequence[Link], source: Path) -> None:
    """Find links that move without mass, before the engines do."""
    rigid = rigid_bodies(tuple(links))
    masses = dict.fromkeys(rigid.values(), 0.0)
    for link in links:
        masses[rigid[link.name]] += link.mass
    empty = [link for link in links if link.joint and masses[link.name] == 0.0]
    if empty:
        shown = ", ".join(f"'{link.name}'" for link in empty[:6])
        more = f" and {len(empty) - 6} more" if len(empty) > 6 else ""
        raise DescriptionError(
            f"{source}: the links {shown}{more} move but weigh nothing, so no motor "
            "could hold them still. Give each a mass and an inertia (1e-3 kg and "
            "1e-6 kg m^2 will do for a dummy), or make its joint fixed."
        )


def inertia_fields(tensor: Matrix) -> tuple[float, ...]:
    """Return `xx yy zz xy xz yz` of a symmetric matrix, shape (3, 3)."""
    rows, columns = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
    return tuple(tensor[rows, columns].tolist())
