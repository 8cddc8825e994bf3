"""Arrangement of one robot, or of two arms, in front of a task."""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Protocol, TypeAlias, TypeVar, runtime_checkable

from pydantic import AfterValidator, PositiveFloat

from wbc_suite.errors import ConfigError
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.shapes import Real
from wbc_suite.scene import place_robot

T = TypeVar("T")


def with_default(values: dict[str, Any]) -> dict[str, Any]:
    """Check that there is an entry named `default`."""
    if "default" not in values:
        raise ValueError("an entry named 'default' is needed")
    return values


Places: TypeAlias = Annotated[
    dict[str, tuple[Real, Real]], AfterValidator(with_default)
]
"""Position of each robot, m; `default` is that of all others."""

Opposed: TypeAlias = Annotated[dict[str, PositiveFloat], AfterValidator(with_default)]
"""Distance of each of two opposed robots from the middle, m; `default` likewise."""


@runtime_checkable
class TwoArmPlaces(Protocol):
    """Places of robots in the file of a two-arm benchmark; distances in m.

    Attributes:
        places: Place of a single robot, and of two in parallel.
        opposed: Distance of each of two robots that face one another from the middle.
        apart: Distance of each of two robots in parallel from its place.
    """

    name: str
    places: dict[str, tuple[float, float]]
    opposed: dict[str, float]
    apart: float


def arrange_one(
    name: str,
    robots: Sequence[RobotDescription],
    configuration: str,
    places: Mapping[str, tuple[float, float]],
) -> tuple[RobotDescription, ...]:
    """Return the only robot at its place, facing +x.

    Raises:
        ConfigError: If there are several robots, or the configuration is for several.
    """
    if len(robots) != 1:
        raise ConfigError(f"{name} takes one robot, not {len(robots)}.")
    if configuration not in ("default", "single-robot"):
        raise ConfigError(
            f"{name}: env_configuration '{configuration}' is not for one robot; use "
            "'default'."
        )
    (robot,) = robots
    return (place_robot(robot, _own(places, robot), 0.0),)


def arrange_two_arms(
    config: TwoArmPlaces, robots: Sequence[RobotDescription], configuration: str
) -> tuple[RobotDescription, ...]:
    """Return two robots opposed or in parallel, or one with two arms at its place.

    Arm 0 is that of the first robot, or the right one, and starts towards -y; arm 1 is
    that of the second robot, or the left one. Opposed robots stand on the y axis and
    face one another; the others face +x.

    Raises:
        ConfigError: If the robots do not have two arms, or cannot stand so.
    """
    if sum(len(robot.hands) for robot in robots) != 2 or len(robots) > 2:
        names = ", ".join(f"{r.name} with {len(r.hands)}" for r in robots)
        raise ConfigError(
            f"{config.name} needs two arms: two robots with one, such as Panda "
            f"and Panda, or one robot with two, such as Baxter; not {names}."
        )
    alone = len(robots) == 1
    if configuration == "default":
        configuration = "single-robot" if alone else "opposed"
    if alone != (configuration == "single-robot"):
        raise ConfigError(
            f"{config.name}: env_configuration '{configuration}' is not for "
            f"{len(robots)} robot(s); two are 'opposed' or 'parallel', one is "
            "'single-robot'."
        )
    if alone:
        return arrange_one(config.name, robots, configuration, config.places)
    placed = []
    for robot, side in zip(robots, (-1, 1), strict=True):
        (x, y), yaw = _own(config.places, robot), 0.0
        y += side * config.apart
        if configuration == "opposed":
            x, y = 0.0, side * _own(config.opposed, robot)
            yaw = -side * math.pi / 2
        placed.append(place_robot(robot, (x, y), yaw))
    return tuple(placed)


def _own(places: Mapping[str, T], robot: RobotDescription) -> T:
    return places.get(robot.name, places["default"])
