"""Robots in a simulation, under robosuite's names."""

from collections.abc import Callable
from typing import Any

from wbc_suite.compat.robosuite.models.robots import REGISTERED_ROBOTS
from wbc_suite.compat.robosuite.robots.robot import Robot, models_of

__all__ = ["ALL_ROBOTS", "ROBOT_CLASS_MAPPING", "models_of"]


class FixedBaseRobot(Robot):
    """A robot whose base is fixed to the world."""


class MobileRobot(Robot):
    """A robot whose base moves."""

    def enable_parts(self, **parts: bool) -> None:
        """Switch parts on or off by name; those that are not named are on."""
        self.disabled = {part for part, on in parts.items() if not on}


class WheeledRobot(MobileRobot):
    """A robot on wheels."""


class LeggedRobot(MobileRobot):
    """A robot on legs."""


target_type_mapping = {
    cls.__name__: cls
    for cls in (FixedBaseRobot, MobileRobot, WheeledRobot, LeggedRobot)
}
_LEGGED, _WHEELED = ("GR1", "Spot"), ("Tiago", "PandaOmron")


def _kind(name: str) -> type[Robot]:
    if name.startswith(_LEGGED):
        return LeggedRobot
    return WheeledRobot if name.startswith(_WHEELED) else FixedBaseRobot


ALL_ROBOTS = REGISTERED_ROBOTS.keys()
ROBOT_CLASS_MAPPING: dict[str, type[Robot]] = {
    name: _kind(name) for name in REGISTERED_ROBOTS
}


def register_robot_class(
    target_type: str, **kwargs: Any
) -> Callable[[type[Any]], type[Any]]:
    """Decorate a model's class; its robots are of a type, such as `LeggedRobot`."""

    def register(target_class: type[Any]) -> type[Any]:
        ROBOT_CLASS_MAPPING[target_class.__name__] = target_type_mapping[target_type]
        return target_class

    return register
