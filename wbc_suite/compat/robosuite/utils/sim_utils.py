"""Contacts in a simulation, by names of geoms."""

from collections.abc import Iterable
from typing import Any

from wbc_suite.compat.robosuite.utils.binding_utils import MjSim


def contact_pairs(sim: MjSim) -> list[list[int]]:
    """Return the two geoms of each contact."""
    data = sim.data._data
    return data.contact.geom.tolist() if data.ncon else []


def names_of(geoms: Any) -> set[str]:
    """Return names of geoms: given one by one, as a list, or by a model's geoms."""
    given = getattr(geoms, "contact_geoms", geoms)
    return {given} if isinstance(given, str) else set(given)


def check_contact(sim: MjSim, geoms_1: Any, geoms_2: Any = None) -> bool:
    """Whether a geom of the first set touches one of the second, or any other."""
    first = _indices(sim, names_of(geoms_1))
    second = None if geoms_2 is None else _indices(sim, names_of(geoms_2))
    for a, b in contact_pairs(sim):
        for one, other in ((a, b), (b, a)):
            if one in first and (second is None or other in second):
                return True
    return False


def get_contacts(sim: MjSim, model: Any) -> set[str]:
    """Return the names of the geoms that touch a model, its own left out."""
    own, names = _indices(sim, names_of(model)), sim.model.names("geom")
    touching = {
        b if a in own else a for a, b in contact_pairs(sim) if (a in own) != (b in own)
    }
    return {names[geom] for geom in touching if names[geom]}


def _indices(sim: MjSim, names: Iterable[str]) -> set[int]:
    """Return the indices of geoms; names that the scene does not have are left out."""
    found = (sim.model.find("geom", name) for name in names)
    return {index for index in found if index is not None}
