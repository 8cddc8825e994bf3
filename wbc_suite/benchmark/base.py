"""The interface of benchmarks, their registry, and how their files are loaded."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol, TypeVar

import mujoco
import numpy as np
from pydantic import BaseModel

from wbc_suite.catalogue import Catalogue
from wbc_suite.control import RobotState
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import RobotDescription
from wbc_suite.scene import Push
from wbc_suite.sensing.reading import Reading
from wbc_suite.tomlfile import located, parse_model, read_toml

C = TypeVar("C", bound=BaseModel)


class Benchmark(Protocol):
    """A task: a scene, start states, a reward and a success; no controller.

    Attributes:
        title: The task in a few words, in the imperative.
        horizon: Default number of actions in an episode.
        robots: Default robots.
        gripper: Default gripper of the robots; None for their own.
        pushes: Forces on bodies in this episode, drawn at a reset.
    """

    name: str
    title: str
    horizon: int
    robots: Sequence[str]
    gripper: str | None
    pushes: Sequence[Push]

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


_BUILDERS: dict[str, Callable[[Path], Benchmark]] = {}


def register_benchmark(name: str, build: Callable[[Path], Benchmark]) -> None:
    """Register a benchmark; `build` gets the path of `tasks/{name}.toml`."""
    _BUILDERS[name] = build


def benchmark_names() -> tuple[str, ...]:
    """Return the names of all benchmarks."""
    return tuple(sorted(_BUILDERS))


def load_benchmark(
    name: str | Path | Callable[[], Benchmark], catalogue: Catalogue | None = None
) -> Benchmark:
    """Make a benchmark by its name, without regard to case, or from its file.

    A class of your own, or a function that returns a benchmark, is called.

    Raises:
        UnknownNameError: If there is no such benchmark.
        ConfigError: If its file is wrong.
    """
    if not isinstance(name, str | Path):
        if not callable(name):
            raise UnknownNameError("benchmark", name, _BUILDERS)
        return name()
    if str(name).endswith(".toml"):
        path = Path(name)
        try:
            known = _find(str(read_toml(path).get("name")))
        except UnknownNameError as error:
            where = f"{path}: {located('name', str(path))}"
            raise ConfigError(f"{where}: {error}") from error
        return _BUILDERS[known](path)
    known = _find(str(name))
    path = (catalogue or Catalogue()).find("tasks", known, kind="benchmark file")
    return _BUILDERS[known](path)


def _find(name: str) -> str:
    for known in _BUILDERS:
        if known.casefold() == name.casefold():
            return known
    raise UnknownNameError("benchmark", name, _BUILDERS)


def load_config(model: type[C], path: Path) -> C:
    """Read a benchmark's file; one that `extends` another has only the differences.

    Raises:
        ConfigError: If it is wrong, or extends a file outside its folder.
    """
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
    return parse_model(model, data, source=str(path))
