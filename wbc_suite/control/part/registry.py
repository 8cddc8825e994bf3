"""Part controllers by name: their classes and the models of their configs."""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

from pydantic import BaseModel

from wbc_suite.config_files import located, parse_model
from wbc_suite.control.part.controller import PartController
from wbc_suite.control.robot_parts import hands_of, robot_part
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.registry import Registry
from wbc_suite.robot import RobotDescription

PartControllerName: TypeAlias = Literal[
    "OSC_POSE",
    "OSC_POSITION",
    "IK_POSE",
    "JOINT_POSITION",
    "JOINT_VELOCITY",
    "JOINT_TORQUE",
    "BASE_VELOCITY",
    "STANCE",
]
"""Names of the built-in part controllers."""


class PartKind(NamedTuple):
    """A registered kind of part controller: its class, and the model of its config."""

    controller: type[PartController]
    config: type[BaseModel]


def _check(name: str, kind: PartKind) -> None:
    if not issubclass(kind.controller, PartController):
        raise ConfigError(
            f"{kind.controller.__name__}: part controller '{name}' derives from "
            "PartController."
        )
    if missing := sorted(kind.controller.__abstractmethods__):
        raise ConfigError(
            f"{kind.controller.__name__}: part controller '{name}' lacks "
            f"{', '.join(missing)}, see PartController."
        )
    field = kind.config.model_fields.get("type")
    if field is None or name not in get_args(field.annotation):
        raise ConfigError(
            f"{kind.config.__name__}: part controller '{name}' needs the field "
            f"type: Literal['{name}'] = '{name}'."
        )


PART_CONTROLLERS: Registry[PartKind] = Registry("part controller", check=_check)
"""Part controllers by name."""


def register_part_controller(
    name: str,
    controller: type[PartController],
    config: type[BaseModel],
    *,
    replace: bool = False,
) -> None:
    """Add a part controller to those that controller files may name.

    With `register_part_controller("MINE", MyController, MyConfig)` in a module that is
    imported, `make(..., controller_configs="MINE")` uses it in all arms, and
    `{"type": "MINE", ...}` in `body_parts` to one part.

    The class is called by `controller(part, config, state)`. The config's model has the
    field `type: Literal[name] = name`; derive it from `PartSettings`, or from
    `FrozenModel` for a controller without gripper.

    Raises:
        ConfigError: If the name is taken, the class lacks a method, or the config's
            type is not that name.
    """
    PART_CONTROLLERS.register(name, PartKind(controller, config), replace=replace)


def part_controller(config: Any) -> type[PartController]:
    """Return the class of the part controller that a config is for."""
    return PART_CONTROLLERS[config.type].controller


def load_part_controller_config(controller: PartControllerName | str) -> dict[str, Any]:
    """Return the defaults of a part controller as plain data, `{"type": ...}`.

    Raises:
        UnknownNameError: If there is none of this name.
    """
    model = PART_CONTROLLERS[controller].config
    config = model.model_validate({"type": PART_CONTROLLERS.spelled(controller)})
    return config.model_dump(mode="json", exclude_none=True)


def parse_part(name: str, given: object, source: str) -> BaseModel:
    """Return the config of a part, plain data or a model, as a model.

    Raises:
        ConfigError: If the type is unknown, or a key or a value is wrong; it names the
            source.
    """
    key = f"body_parts.{name}"
    if isinstance(given, BaseModel):
        return given
    if not isinstance(given, Mapping):
        raise ConfigError(
            f"{source}: {located(key, source)} = {given!r:.80}: not a table."
        )
    if "type" not in given:
        raise ConfigError(f"{source}: missing {located(f'{key}.type', source)}")
    try:
        kind = PART_CONTROLLERS.spelled(given["type"])
    except UnknownNameError as error:
        where = located(f"{key}.type", source)
        raise ConfigError(f"{source}: {where}: {error}") from error
    model = PART_CONTROLLERS[kind].config
    return parse_model(model, {**given, "type": kind}, source=source, within=key)


def check_part(name: str, config: Any, robot: RobotDescription) -> None:
    """Check the config of a part against a robot.

    Raises:
        ConfigError: If the robot has no such part, or the controller cannot drive it.
    """
    part, controller = robot_part(robot, name), part_controller(config)
    if controller.needs_hand and part.hand is None:
        raise ConfigError(
            f"{config.type} needs a hand, and {robot.name}'s '{name}' does not end in "
            f"one. Parts that do: {', '.join(hands_of(robot)) or 'none'}."
        )
    is_base = part.joints == robot.root_joint_names
    if controller.drives_base and name != "base":
        raise ConfigError(f"{config.type} drives the part 'base', not '{name}'.")
    if is_base and not controller.drives_base:
        of_bases = [
            kind
            for kind in PART_CONTROLLERS
            if PART_CONTROLLERS[kind].controller.drives_base
        ]
        raise ConfigError(
            f"a base is driven by {' or '.join(of_bases)}, not by {config.type}."
        )
    controller.check(config, part, robot)


def make_part(name: str, config: Any, state: RobotState) -> PartController:
    """Make the controller of a part that `check_part` has accepted.

    Raises:
        ConfigError: If its constructor does not set `law` and `slices`.
    """
    build: Any = part_controller(config)  # each class has arguments of its own types
    made: PartController = build(robot_part(state.robot, name), config, state)
    if missing := [x for x in ("law", "slices") if not hasattr(made, x)]:
        raise ConfigError(
            f"{config.type}: the constructor of {build.__name__} does not set "
            f"{' and '.join(missing)}, see PartController."
        )
    return made
