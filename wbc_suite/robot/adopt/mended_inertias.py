"""Masses and inertias of imported links: those that no body has are mended."""

from collections.abc import Sequence
from pathlib import Path

from wbc_suite import logs
from wbc_suite.errors import DescriptionError, join_first, shortened
from wbc_suite.robot.adopt.missing_data import (
    ellipsoid,
    estimate_masses,
    gyration_fault,
)
from wbc_suite.robot.elements import Frame, Link, rigid_bodies
from wbc_suite.robot.inertia import implausible, nearest_physical, unphysical

LOG = logs.logger(__name__)

CARRIER_MASS, END_MASS = 1e-10, 1e-3
"""Mass in kg of a moving link for which the file has none, if it carries others."""
GYRATION = 0.03  # radius of gyration of such a link, m
MAX_MESSAGE = 800  # largest number of characters of a list in a message


def mend_inertias(
    links: list[Link], frames: Sequence[Frame], source: Path, *, strict: bool
) -> list[Link]:
    """Return links with masses and inertias that bodies can have.

    Raises:
        DescriptionError: If they have others, and `strict`.
    """
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
