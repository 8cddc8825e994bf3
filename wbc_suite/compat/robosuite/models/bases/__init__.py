"""Bases of robots; the catalogue's are known by name."""

from typing import Any

from wbc_suite.catalogue import Catalogue
from wbc_suite.compat.robosuite.models.base import MujocoModel

__all__ = ["ALL_BASES", "BASE_MAPPING", "RobotBaseModel", "register_base"]


class RobotBaseModel(MujocoModel):
    """A base by its name in the catalogue; names in the scene start as its robot's."""

    def __init__(self, idn: int = 0) -> None:
        self.idn = idn

    @property
    def name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride] - its class's
        """Name of its class."""
        return type(self).__name__

    @property
    def naming_prefix(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride] - its number's
        """Text before the names of its elements."""
        return f"robot{self.idn}_"


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
