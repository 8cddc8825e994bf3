"""Composite controllers: what drives a whole robot, and where they are found."""

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

from wbc_suite.catalogue import Catalogue
from wbc_suite.control.action import ActionLayout
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.tomlfile import read_toml
from wbc_suite.typing import Vector

__all__ = [
    "CompositeController",
    "CompositeKind",
    "build_composite_controller",
    "composite_names",
    "load_composite_controller_config",
    "register_composite",
]

log = logging.getLogger(__name__)


class CompositeController(Protocol):
    """Drives all actuators of one robot.

    The order of calls is `reset`, then `set_goal` once per action, then `compute` once
    per physics step, between `mj_step1` and `mj_step2`.

    Attributes:
        layout: Slices of the action.
    """

    layout: ActionLayout

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the present goals."""
        ...

    def info(self, state: RobotState) -> dict[str, Any]:
        """Return what to tell in the environment's `info`, by key."""
        ...

    def reset(self, state: RobotState) -> None:
        """Start from where the robot is; goals hold it there."""
        ...

    def set_goal(self, action: Vector) -> None:
        """Take an action that `layout` has checked and clipped."""
        ...

    def compute(self, state: RobotState) -> Vector:
        """Return one command per actuator, in the order of `state.actuators`.

        A command is a torque, or a set point where the actuator is a servo.
        """
        ...


Builder = Callable[[Mapping[str, Any], RobotState], CompositeController]
Check = Callable[[Mapping[str, Any], RobotDescription | None, str], None]
DefaultConfig = Callable[[RobotDescription], dict[str, Any]]


class CompositeKind:
    """A registered kind of composite controller.

    Args:
        build: Makes a controller out of a config and the robot in a simulation.
        family: Files `controllers/{robot}_{family}.toml` hold its configs.
        default: Makes a config for a robot that has no file.
        check: Raises ConfigError for what is wrong in a config, for a robot or for
            none, and names the source.
    """

    def __init__(
        self, build: Builder, family: str, default: DefaultConfig, check: Check
    ) -> None:
        self.build, self.family, self.default = build, family, default
        self.check = check


_KINDS: dict[str, CompositeKind] = {}


def _accept(
    config: Mapping[str, Any], robot: RobotDescription | None, source: str
) -> None:
    """Check nothing: `build` will."""


def register_composite(
    name: str,
    build: Builder,
    *,
    family: str,
    default: DefaultConfig,
    check: Check = _accept,
) -> None:
    """Make a kind of composite controller known under a name, case ignored.

    Raises:
        ConfigError: If the name is taken.
    """
    if name.upper() in _KINDS:
        raise ConfigError(f"A composite controller named '{name}' exists already.")
    _KINDS[name.upper()] = CompositeKind(build, family, default, check)


def composite_names() -> tuple[str, ...]:
    """Return the names of all registered kinds."""
    return tuple(sorted(_KINDS))


def load_composite_controller_config(
    controller: str | Path | Mapping[str, Any] | None = None,
    robot: str | Path | RobotDescription | None = None,
    *,
    catalogue: Catalogue | None = None,
) -> dict[str, Any]:
    """Return a composite controller's config as plain data, `{"type": ..., ...}`.

    Args:
        controller: A registered name such as `WHOLE_BODY_IK` (the default), a path to
            a TOML file, or a config, which is returned as a copy.
        robot: The robot; needed with a name. Names in the config are checked against
            it.
        catalogue: Where to look for the robot's file; ours by default.

    Raises:
        UnknownNameError: If the controller or robot is unknown.
        ConfigError: If the file cannot be read, or the robot is missing.
    """
    catalogue = catalogue or Catalogue()
    if robot is not None and not isinstance(robot, RobotDescription):
        robot = load_robot(robot, catalogue=catalogue)
    config, source = _read(controller, robot, catalogue)
    _kind_of(config).check(config, robot, source)
    return config


def _read(
    controller: object, robot: RobotDescription | None, catalogue: Catalogue
) -> tuple[dict[str, Any], str]:
    """Return a config, and what to call it in messages."""
    if isinstance(controller, Mapping):
        config = dict(controller)
        return config, str(config.get("type"))
    if not isinstance(controller, str | Path | None):
        raise UnknownNameError("composite controller", controller, _KINDS)
    name = str(controller or "WHOLE_BODY_IK")
    if name.endswith(".toml"):
        return {"type": "WHOLE_BODY_IK"} | read_toml(Path(name)), name
    kind = _find(name)
    if robot is None:
        raise ConfigError(f"Controller '{name}' needs a robot to be configured for.")
    own_type = {"type": name.upper()}
    try:
        file = catalogue.find(
            "controllers", f"{robot.name}_{kind.family}", kind="controller file"
        )
    except UnknownNameError:
        return kind.default(robot) | own_type, f"{name} for {robot.name}"
    config = read_toml(file) | own_type
    if catalogue.is_ours(file) and not _fits(kind, config, robot):
        log.warning("%s is not for this '%s': names differ.", file.name, robot.name)
        return kind.default(robot) | own_type, f"{name} for {robot.name}"
    return config, str(file)


def _fits(
    kind: CompositeKind, config: Mapping[str, Any], robot: RobotDescription
) -> bool:
    """Whether the robot is ours, and not another of the same name."""
    try:
        kind.check(config, robot, "")
    except ConfigError:
        return False
    return True


def build_composite_controller(
    config: Mapping[str, Any], state: RobotState
) -> CompositeController:
    """Make the controller that a config describes for a robot in a simulation.

    Raises:
        UnknownNameError: If the type, or a frame or joint in it, is unknown.
        ConfigError: If a key or a value is wrong.
    """
    return _kind_of(config).build(config, state)


def _kind_of(config: Mapping[str, Any]) -> CompositeKind:
    if not isinstance(config.get("type"), str):
        raise ConfigError(
            f"A controller config needs a key 'type', one of: "
            f"{', '.join(composite_names())}."
        )
    return _find(config["type"])


def _find(name: str) -> CompositeKind:
    if name.upper() not in _KINDS:
        raise UnknownNameError("composite controller", name, _KINDS)
    return _KINDS[name.upper()]
