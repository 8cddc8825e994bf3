"""The interface of benchmarks, their registry, and how their files are loaded."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeAlias, TypeVar

import mujoco
import numpy as np
from pydantic import BaseModel

from wbc_suite.catalogue import Catalogue
from wbc_suite.control import RobotState
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.xml_files import real_path
from wbc_suite.scene import ArenaConfig, Push, TableConfig
from wbc_suite.sensing.reading import Reading
from wbc_suite.tomlfile import located, parse_model, read_toml

C = TypeVar("C", bound=BaseModel)
Arena: TypeAlias = str | Path | Mapping[str, Any]
"""An MJCF scene, or the keys of an `ArenaConfig`."""


@dataclass(frozen=True, kw_only=True, slots=True)
class InArena:
    """A benchmark's file, and an arena in place of that in the file."""

    path: Path
    arena: Arena


Source: TypeAlias = Path | InArena


class Benchmark(Protocol):
    """A task: a scene, start states, a reward and a success; no controller.

    Attributes:
        title: The task in a few words, in the imperative.
        horizon: Default number of actions in an episode.
        robots: Default robots.
        gripper: Default gripper of the robots; None for their own.
        pushes: Forces on bodies in this episode, drawn at a reset.
        arena: The scene around it; None for an empty floor.
    """

    name: str
    title: str
    horizon: int
    robots: Sequence[str]
    gripper: str | None
    pushes: Sequence[Push]
    arena: ArenaConfig | None

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return the robots at their places in the scene.

        The configuration is `default`, `single-robot`, `opposed` or `parallel`.

        Raises:
            ConfigError: If their number or the configuration is not supported.
        """
        ...

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add furniture, objects and cameras to an empty arena."""
        ...

    def equip(self, spec: mujoco.MjSpec, robots: Sequence[RobotDescription]) -> None:
        """Add objects that are fixed to the robots, which are in the scene now."""
        ...

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up in the compiled scene all that the other methods need."""
        ...

    def reset(self, rng: np.random.Generator) -> None:
        """Place the objects; positions and sizes are written into model and data."""
        ...

    def after_step(self) -> None:
        """Update the benchmark's own state after a control period.

        It belongs into `data.userdata`, so that it is part of the simulation's state.
        """
        ...

    def observables(self) -> dict[str, Reading]:
        """Return readings of the objects by key; see `wbc_suite.sensing.reading`.

        Called once, after `bind`.
        """
        ...

    def robot_observables(self) -> dict[str, dict[str, Reading]]:
        """Return readings that belong to robots, by prefix and key; called likewise."""
        ...

    def success(self) -> bool:
        """Whether the task is solved now."""
        ...

    def failure(self) -> str | None:
        """Return why the task cannot be solved any more, or None; ends the episode."""
        ...

    def reward(self, *, shaped: bool, success: bool | None = None) -> float:
        """Return a reward in [0, 1], 1 on success; if shaped, without success too.

        `success` is the present value of `success()`, if known.
        """
        ...


_BUILDERS: dict[str, Callable[[Any], Benchmark]] = {}


def register_benchmark(name: str, build: Callable[[Any], Benchmark]) -> None:
    """Register a benchmark; `build` gets the path of `tasks/{name}.toml`.

    In an arena it gets an `InArena`; `load_config` takes both.
    """
    _BUILDERS[name] = build


def benchmark_names() -> tuple[str, ...]:
    """Return the names of all benchmarks."""
    return tuple(sorted(_BUILDERS))


def load_benchmark(
    name: str | Path | Callable[[], Benchmark],
    catalogue: Catalogue | None = None,
    *,
    arena: Arena | None = None,
) -> Benchmark:
    """Make a benchmark by its name, without regard to case, or from its file.

    A class of your own, or a function that returns a benchmark, is called. It brings
    its own table into an arena.

    Raises:
        UnknownNameError: If there is no such benchmark.
        ConfigError: If its file is wrong.
    """
    if not isinstance(name, str | Path):
        if not callable(name):
            raise UnknownNameError("benchmark", name, _BUILDERS)
        own = name()
        if arena is not None:
            own.arena = parse_arena(arena)
        return own
    if str(name).endswith(".toml"):
        path = Path(name)
        try:
            known = _find(str(read_toml(path).get("name")))
        except UnknownNameError as error:
            where = f"{path}: {located('name', str(path))}"
            raise ConfigError(f"{where}: {error}") from error
    else:
        known = _find(str(name))
        path = (catalogue or Catalogue()).find("tasks", known, kind="benchmark file")
    build = _BUILDERS[known]
    return build(path if arena is None else InArena(path=path, arena=arena))


def parse_arena(arena: Arena, *, source: Path | None = None) -> ArenaConfig:
    """Check an arena; its file is relative to that of the source, if there is one.

    Raises:
        ConfigError: Names the key, its value and what is allowed.
    """
    keys = dict(arena) if isinstance(arena, Mapping) else {"file": arena}
    config = parse_model(
        ArenaConfig, keys, source=str(source or "make()"), within="arena"
    )
    if source is None:
        return config
    file, folder = source.parent / config.file, real_path(source.parent)
    if not real_path(file).is_relative_to(folder):
        where = f"{source}: {located('arena.file', str(source))}"
        raise ConfigError(
            f"{where} = '{config.file}' lies outside the folder {folder} and is not "
            "read. Copy it into that folder, or name it by the argument `arena`."
        )
    return config.model_copy(update={"file": file})


def _find(name: str) -> str:
    for known in _BUILDERS:
        if known.casefold() == name.casefold():
            return known
    raise UnknownNameError("benchmark", name, _BUILDERS)


def load_config(model: type[C], source: Source) -> C:
    """Read a benchmark's file; one that `extends` another has only the differences.

    In an arena with a surface, that is the table.

    Raises:
        ConfigError: If it is wrong, or extends a file outside its folder.
    """
    path = source.path if isinstance(source, InArena) else source
    data = _read(path)
    arena = data.pop("arena", None)
    config = parse_model(model, data, source=str(path))
    if isinstance(source, InArena):
        return _in_arena(config, parse_arena(source.arena))
    if arena is None:
        return config
    return _in_arena(config, parse_arena(arena, source=path))


def _in_arena(config: C, arena: ArenaConfig) -> C:
    """Return a config in an arena, whose surface replaces the only table."""
    table = getattr(config, "table", None)
    if isinstance(table, TableConfig) and getattr(config, "one_table", True):
        arena, table = arena.with_surface(table)
        return config.model_copy(update={"arena": arena, "table": table})
    if arena.surface is not None:
        raise ConfigError(
            f"arena: surface = {arena.surface!r}: {getattr(config, 'name', '')} does "
            "not have exactly one table to replace. Leave `surface` out, and give `at` "
            "and `yaw`."
        )
    return config.model_copy(update={"arena": arena})


def _read(path: Path) -> dict[str, Any]:
    data = read_toml(path)
    base = data.pop("extends", None)
    if base is not None:
        name = str(base)
        if name != Path(name).name:
            raise ConfigError(
                f"{path}: key 'extends' = {name!r}: name a file of the same folder, "
                "without folder and ending."
            )
        try:
            data = read_toml(path.with_name(f"{name}.toml")) | data
        except ConfigError as error:
            raise ConfigError(f"{path}: key 'extends' = {name!r}: {error}") from error
    return data
