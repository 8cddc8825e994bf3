"""Composite controllers: what drives a whole robot, and where they are found."""

import importlib.metadata
from collections.abc import Callable, Mapping
from functools import cache, reduce
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

from wbc_suite import logs
from wbc_suite.catalogue import Catalogue, merge
from wbc_suite.config_files import located, read_json, read_toml
from wbc_suite.control.composite.protocols import CompositeController
from wbc_suite.control.part.registry import (
    PART_CONTROLLERS,
    PartControllerName,
)
from wbc_suite.control.robot_parts import hands_of
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.registry import Registry
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.typing import RobotName

log = logs.logger(__name__)

CompositeControllerName: TypeAlias = Literal[
    "BASIC",
    "HYBRID_MOBILE_BASE",
    "WHOLE_BODY_ID",
    "WHOLE_BODY_IK",
    "WHOLE_BODY_MINK_IK",
]
"""Names of the built-in composite controllers."""


Builder = Callable[[Mapping[str, Any], RobotState], CompositeController]
Check = Callable[[Mapping[str, Any], RobotDescription | None, str], object]
DefaultConfig = Callable[[RobotDescription], dict[str, Any]]


class CompositeKind(NamedTuple):
    """A registered kind of composite controller; see `register_composite`."""

    build: Builder
    family: str
    default: DefaultConfig
    check: Check


COMPOSITES: Registry[CompositeKind] = Registry("composite controller")
"""Kinds of composite controllers by name."""

Converter: TypeAlias = Callable[
    [dict[str, Any], RobotDescription | None, str, Callable[[str], dict[str, Any]]],
    dict[str, Any] | None,
]

CONVERTERS: Registry[Converter] = Registry("converter of configs")
"""Functions that read configs in another layout, by its name.

`(config, robot, source, named)` returns our config of the same meaning, or None for
what is not in its layout; `named(type)` returns the robot's usual config of a
composite. Installed packages add theirs by an entry point of the group
`wbc_suite.config_converters`.
"""

register_config_converter = CONVERTERS.register


def register_composite(
    name: str,
    build: Builder,
    *,
    family: str,
    default: DefaultConfig,
    check: Check = lambda config, robot, source: None,
    replace: bool = False,
) -> None:
    """Make a kind of composite controller known under a name, case ignored.

    `build` makes a controller out of a config and the robot in a simulation. Configs
    are in files `controllers/{robot}_{family}.toml`; `default` makes one for a robot
    without a file. `check` raises ConfigError for what is wrong in a config, for a
    robot or for none, and names the source; by default `build` does.

    Raises:
        ConfigError: If the name is taken.
    """
    kind = CompositeKind(build, family, default, check)
    COMPOSITES.register(name, kind, replace=replace)


def load_composite_controller_config(
    controller: CompositeControllerName
    | PartControllerName
    | str
    | Path
    | Mapping[str, Any]
    | None = None,
    robot: RobotName | str | Path | RobotDescription | None = None,
    *,
    catalogue: Catalogue | None = None,
) -> dict[str, Any]:
    """Return a composite controller's config as plain data, `{"type": ..., ...}`.

    Args:
        controller: A registered name such as `BASIC`, the name of a part controller
            such as `OSC_POSE` (BASIC with that in all arms), a path to a TOML file or
            to a JSON file of robosuite, or a config, which is returned as a copy.
            None: that of `default_composite`.
        robot: Needed with a name. Names in the config are checked against it.
        catalogue: Where to look for the robot's file; ours by default.

    Raises:
        UnknownNameError: If the controller or robot is unknown.
        ConfigError: If the file cannot be read, or the robot is missing.
    """
    catalogue = catalogue or Catalogue()
    if robot is not None and not isinstance(robot, RobotDescription):
        robot = load_robot(robot, catalogue=catalogue)
    config, source = _read(controller, robot, catalogue)
    try:
        kind = _kind_of(config)
    except UnknownNameError as error:
        if Path(source).suffix != ".toml":
            raise
        raise ConfigError(f"{source}: {located('type', source)}: {error}") from error
    kind.check(config, robot, source)
    return config


def _read(
    controller: object, robot: RobotDescription | None, catalogue: Catalogue
) -> tuple[dict[str, Any], str]:
    """Return a config, and what to call it in messages."""
    if isinstance(controller, Mapping):
        source = str(controller.get("type"))
        return _converted(dict(controller), source, robot, catalogue), source
    if not isinstance(controller, str | Path | None):
        raise UnknownNameError("composite controller", controller, COMPOSITES)
    name = controller or (default_composite(robot, catalogue) if robot else "BASIC")
    name = str(name)
    if name.endswith(".json"):
        return _converted(read_json(Path(name)), name, robot, catalogue), name
    if name in PART_CONTROLLERS:
        return _of_arms(name, robot, catalogue), name
    if name.endswith(".toml"):
        config = _read_file(Path(name), robot, catalogue)
        return {"type": _kind_in(config)} | config, name
    return _named(name, robot, catalogue)


def _read_file(
    path: Path, robot: RobotDescription | None, catalogue: Catalogue
) -> dict[str, Any]:
    """Return a file merged with those that it extends.

    The last may extend a composite: the config that the robot has of it.
    """
    layers: list[dict[str, Any]] = []

    def base_of(file: Path) -> str | None:
        layers.append(data := read_toml(file))
        name = data.get("extends")
        return None if name is None or name in COMPOSITES else str(name)

    catalogue.chain("controllers", path, kind="controller file", base_of=base_of)
    if (name := layers[-1].get("extends")) is not None:
        layers.append(_named(name, robot, catalogue)[0])
    merged = reduce(merge, reversed(layers))
    return {key: value for key, value in merged.items() if key != "extends"}


def _kind_in(config: Mapping[str, Any]) -> str:
    """Return the kind of a file that does not name it."""
    kinds = {"body_parts": "BASIC", "gait": "WHOLE_BODY_ID"}
    return next((kinds[key] for key in kinds if key in config), "WHOLE_BODY_IK")


def _converted(
    config: dict[str, Any],
    source: str,
    robot: RobotDescription | None,
    catalogue: Catalogue,
) -> dict[str, Any]:
    """Return a config in our layout, whichever it has."""

    def named(name: str) -> dict[str, Any]:
        return _named(name, robot, catalogue)[0]

    _find_converters()
    for name in CONVERTERS:
        found = CONVERTERS[name](config, robot, source, named)
        if found is not None:
            return found
    return config


@cache
def _find_converters() -> None:
    """Register the converters of installed packages."""
    for entry in importlib.metadata.entry_points(group="wbc_suite.config_converters"):
        if entry.name not in CONVERTERS:
            CONVERTERS.register(entry.name, entry.value)


def _of_arms(
    part: str, robot: RobotDescription | None, catalogue: Catalogue
) -> dict[str, Any]:
    """Return BASIC with a part controller in every arm."""
    if robot is None:
        raise ConfigError(f"{part}: name the robot: parts depend on it.")
    basic, _ = _named("BASIC", robot, catalogue)
    arms = {name: {"type": PART_CONTROLLERS.spelled(part)} for name in hands_of(robot)}
    return basic | {"body_parts": basic["body_parts"] | arms}


def default_composite(
    robot: RobotDescription, catalogue: Catalogue | None = None
) -> str:
    """Return the composite of a robot that is asked for none.

    On wheels that touch the floor: BASIC. On its own feet, with a file for it:
    WHOLE_BODY_ID. What else has feet or no hand:
    WHOLE_BODY_IK. Arms on a base that drives: HYBRID_MOBILE_BASE. Other arms: BASIC.
    """
    if robot.root.kind == "free" and _walks(robot, catalogue or Catalogue()):
        return "WHOLE_BODY_ID"
    feet = any(frame.role == "foot" for frame in robot.frames)
    if robot.root.kind == "free" and robot.wheels:
        return "BASIC"
    if not robot.hands or feet:
        return "WHOLE_BODY_IK"
    driven = robot.root.kind == "planar" and robot.root.actuated
    return "HYBRID_MOBILE_BASE" if driven else "BASIC"


def _walks(robot: RobotDescription, catalogue: Catalogue) -> bool:
    """Whether there is a file of WHOLE_BODY_ID that fits the robot."""
    name = f"{robot.name}_whole_body_id"
    try:
        file = catalogue.find("controllers", name, kind="controller file")
        config = _read_file(file, robot, catalogue)
        COMPOSITES["WHOLE_BODY_ID"].check(config, robot, str(file))
    except (UnknownNameError, ConfigError):
        return False
    return True


def _named(
    name: str, robot: RobotDescription | None, catalogue: Catalogue
) -> tuple[dict[str, Any], str]:
    """Return the config of a registered name, from the robot's file if there is one."""
    kind = _find(name)
    if robot is None:
        raise ConfigError(f"Controller '{name}' needs a robot to be configured for.")
    own_type = {"type": COMPOSITES.spelled(name)}
    try:
        stem = f"{robot.name}_{kind.family}"
        file = catalogue.find("controllers", stem, kind="controller file")
    except UnknownNameError:
        return kind.default(robot) | own_type, f"{name} for {robot.name}"
    config = _read_file(file, robot, catalogue) | own_type
    if catalogue.is_ours(file):
        try:
            kind.check(config, robot, "")
        except ConfigError:  # another robot of the same name
            log.warning("%s is not for this '%s': names differ.", file.name, robot.name)
            return kind.default(robot) | own_type, f"{name} for {robot.name}"
    return config, str(file)


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
            f"{', '.join(sorted(COMPOSITES))}."
        )
    return _find(config["type"])


def _find(name: str) -> CompositeKind:
    if name not in COMPOSITES:
        known = {*COMPOSITES, *PART_CONTROLLERS}
        raise UnknownNameError("composite controller or part controller", name, known)
    return COMPOSITES[name]
