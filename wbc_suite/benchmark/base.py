"""The interface of benchmarks, their registry, and how their files are loaded."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path
from typing import Any, Protocol, TypeAlias, TypeVar, runtime_checkable

import mujoco
import numpy as np
from pydantic import BaseModel

from wbc_suite.catalogue import Catalogue, merge
from wbc_suite.config_files import located, parse_model, read_toml
from wbc_suite.control import RobotState
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.registry import Registry
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.xml_files import real_path
from wbc_suite.scene import ArenaConfig, Push, TableConfig
from wbc_suite.sensing.reading import Reading

C = TypeVar("C", bound=BaseModel)
Arena: TypeAlias = str | Path | Mapping[str, Any]
"""An MJCF scene, or the keys of an `ArenaConfig`."""


@dataclass(frozen=True, kw_only=True, slots=True)
class BenchmarkFile:
    """A benchmark's file, merged with those that it extends.

    Attributes:
        path: Where it is.
        data: Its content.
        names: The names in it and in those that it extends, its own first.
        arena: An arena in place of that in the file, if there is one.
    """

    path: Path
    data: Mapping[str, Any]
    names: tuple[str, ...]
    arena: Arena | None = None

    @classmethod
    def read(cls, path: Path, catalogue: Catalogue | None = None) -> "BenchmarkFile":
        """Read a file, and those that it extends, from its folder or the catalogue.

        Raises:
            ConfigError: If one of them is missing or is not TOML.
        """
        layers: list[dict[str, Any]] = []

        def base_of(file: Path) -> str | None:
            layers.append(data := read_toml(file))
            if isinstance(arena := data.get("arena"), dict) and "file" in arena:
                data["arena"] = arena | {"file": _inside(file, str(arena["file"]))}
            base = data.pop("extends", None)
            return None if base is None else str(base)

        catalogue = catalogue or Catalogue()
        catalogue.chain("tasks", path, kind="benchmark file", base_of=base_of)
        names = (str(data["name"]) for data in layers if "name" in data)
        merged = reduce(merge, reversed(layers))
        return cls(path=path, data=merged, names=tuple(names))


Source: TypeAlias = Path | BenchmarkFile


class Benchmark(Protocol):
    """A task: a scene, start states, a reward and a success; no controller.

    Attributes:
        title: The task in a few words, in the imperative.
        horizon: Default number of actions in an episode, at 20 actions a second.
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


@runtime_checkable
class ResumableBenchmark(Protocol):
    """A benchmark with colours or attributes that follow from its user data."""

    def resume(self) -> None:
        """Follow user data that a saved state has written."""


BENCHMARKS: Registry[Callable[..., Benchmark]] = Registry("benchmark")
"""Classes of benchmarks, or functions that make them, by name.

Those that take an argument get the `BenchmarkFile` of `tasks/{name}.toml` in the
catalogue, which `load_config` takes.
"""

register_benchmark = BENCHMARKS.register

_MEMBERS = ["name", "horizon", "robots"]
_MEMBERS += [method for method in vars(Benchmark) if not method.startswith("_")]


def load_benchmark(
    name: str | Path | Callable[[], Benchmark],
    catalogue: Catalogue | None = None,
    *,
    arena: Arena | None = None,
) -> Benchmark:
    """Make a benchmark by its name, without regard to case, or from its file.

    A file of the catalogue that extends that of a benchmark is a benchmark, too. A
    class of your own, or a function that returns a benchmark, also as `module:Name`, is
    called. It brings its own table into an arena.

    Raises:
        UnknownNameError: If there is no such benchmark.
        ConfigError: If its file is wrong, or it lacks a method.
    """
    if callable(name):
        return _made(name, getattr(name, "__name__", "benchmark"), arena)
    if not isinstance(name, str | Path):
        raise UnknownNameError("benchmark", name, BENCHMARKS)
    asked, catalogue = str(name), catalogue or Catalogue()
    if not asked.endswith(".toml"):
        is_registered = asked in BENCHMARKS
        if ":" in asked or (is_registered and not _takes_file(BENCHMARKS[asked])):
            return _made(BENCHMARKS.find(asked), asked, arena)
        try:
            path = catalogue.find("tasks", asked, kind="benchmark")
        except UnknownNameError as error:
            if is_registered:
                raise
            known = {*BENCHMARKS, *error.known}
            raise UnknownNameError("benchmark", asked, known) from None
    else:
        path = Path(asked)
    file = BenchmarkFile.read(path, catalogue)
    builds = [BENCHMARKS[n] for n in (asked, *file.names) if n in BENCHMARKS]
    if not builds:
        fault = "missing key 'name'"
        if file.names:
            unknown = UnknownNameError("benchmark", file.names[-1], BENCHMARKS)
            fault = f"{located('name', str(path))}: {unknown}"
        raise ConfigError(f"{path}: {fault}")
    return builds[0](replace(file, arena=arena))


def _takes_file(build: Callable[..., Benchmark]) -> bool:
    """Whether a class or function needs an argument: the file of its benchmark."""
    parameters = inspect.signature(build).parameters.values()
    return any(
        p.default is p.empty and p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)
        for p in parameters
    )


def _made(build: Callable[..., Benchmark], name: str, arena: Arena | None) -> Benchmark:
    """Call a class or function that takes no file, and check what it returns."""
    if not callable(build) or _takes_file(build):
        raise ConfigError(
            f"{name}: a benchmark is a class or a function without arguments. One that "
            f"takes a file is registered: register_benchmark('Name', {name})."
        )
    own = build()
    missing = [m for m in _MEMBERS if not hasattr(own, m)]
    if missing:
        raise ConfigError(f"{name} is no benchmark: it lacks {', '.join(missing)}.")
    if arena is not None:
        own.arena = parse_arena(arena)
    return own


def parse_arena(arena: Arena, *, source: Path | None = None) -> ArenaConfig:
    """Check an arena; `source` is the file that errors name, if there is one.

    Raises:
        ConfigError: Names the key, its value and what is allowed.
    """
    keys = dict(arena) if isinstance(arena, Mapping) else {"file": arena}
    config = parse_model(
        ArenaConfig, keys, source=str(source or "make()"), within="arena"
    )
    return config


def _inside(source: Path, name: str) -> str:
    """Return the path of an arena's file that a benchmark's file names.

    Raises:
        ConfigError: If it lies outside of that file's folder.
    """
    file, folder = source.parent / name, real_path(source.parent)
    if not real_path(file).is_relative_to(folder):
        where = f"{source}: {located('arena.file', str(source))}"
        raise ConfigError(
            f"{where} = '{name}' lies outside the folder {folder} and is not read. "
            "Copy it into that folder, or name it by the argument `arena`."
        )
    return str(file)


def load_config(model: type[C], source: Source) -> C:
    """Check a benchmark's file; one that `extends` another has only the differences.

    In an arena with a surface, that is the table.

    Raises:
        ConfigError: If it is wrong, or a file that it extends is missing.
    """
    file = BenchmarkFile.read(source) if isinstance(source, Path) else source
    data = dict(file.data)
    arena = data.pop("arena", None)
    config = parse_model(model, data, source=str(file.path))
    if file.arena is not None:
        return _in_arena(config, parse_arena(file.arena))
    if arena is None:
        return config
    return _in_arena(config, parse_arena(arena, source=file.path))


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
