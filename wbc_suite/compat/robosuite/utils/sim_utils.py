"""Contacts in a simulation, by names of geoms."""

from collections.abc import Iterable
from typing import Any

from wbc_suite.compat.robosuite.utils.binding_utils import MjSim


def contact_names(sim: MjSim) -> list[tuple[str | None, str | None]]:
    """Return the names of the two geoms of each contact."""
    names, data = sim.model.names("geom"), sim.data._data
    pairs = data.contact.geom.tolist() if data.ncon else []
    return [(names[a] or None, names[b] or None) for a, b in pairs]


def names_of(geoms: Any) -> set[str]:
    """Return names of geoms: given one by one, as a list, or by a model's geoms."""
    given = getattr(geoms, "contact_geoms", geoms)
    return {given} if isinstance(given, str) else set(given)


def check_contact(sim: MjSim, geoms_1: Any, geoms_2: Any = None) -> bool:
    """Whether a geom of the first set touches one of the second, or any other."""
    first = _resolved(sim, names_of(geoms_1))
    second = None if geoms_2 is None else _resolved(sim, names_of(geoms_2))
    for a, b in contact_names(sim):
        for one, other in ((a, b), (b, a)):
            if one in first and (second is None or other in second):
                return True
    return False


def get_contacts(sim: MjSim, model: Any) -> set[str]:
    """Return the names of the geoms that touch a model, its own left out."""
    own = _resolved(sim, names_of(model))
    found: set[str] = set()
    for a, b in contact_names(sim):
        if a in own and b not in own and b is not None:
            found.add(b)
        elif b in own and a not in own and a is not None:
            found.add(a)
    return found


def _resolved(sim: MjSim, names: Iterable[str]) -> set[str]:
    """Return names in the scene for those that may be robosuite's."""
    known, ids = sim.model.names("geom"), sim.model
    aliases = ids._aliases.get("geom", {})
    return {name if name in known else aliases.get(name, name) for name in names}
