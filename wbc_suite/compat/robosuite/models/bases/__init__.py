"""Bases of robots; the catalogue's are known by name."""

from typing import Any

from wbc_suite.catalogue import Catalogue
from wbc_suite.compat.robosuite.models.base import MujocoModel


class RobotBaseModel(MujocoModel):
    """A base by its name in the catalogue; names in the scene start as its robot's."""

    def __init__(self, idn: int = 0) -> None:
        self.idn = idn

    name: Any = property(lambda self: type(self).__name__, doc="Name of its class.")
    naming_prefix: Any = property(
        lambda self: f"robot{self.idn}_", doc="Text before the names of its elements."
    )


MountModel = MobileBaseModel = LegBaseModel = NullBaseModel = RobotBaseModel

BASE_MAPPING: dict[str, type[RobotBaseModel]] = {
    name: type(name, (RobotBaseModel,), {"__module__": __name__})
    for name in Catalogue().called("robots/base")
}
ALL_BASES = BASE_MAPPING.keys()
globals().update(BASE_MAPPING)


def register_base(target_class: type[Any]) -> type[Any]:
    """Make a class known by its name."""
    BASE_MAPPING[target_class.__name__] = target_class
    return target_class


def robot_base_factory(name: str | None, idn: int = 0) -> RobotBaseModel:
    """Make a base by name; None is NullMount."""
    return BASE_MAPPING["NullMount" if name is None else name](idn=idn)
