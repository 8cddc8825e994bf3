"""What a benchmark is: a scene, a way to start, a reward and a success."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import mujoco
import numpy as np

from wbc_suite.catalogue import Catalogue
from wbc_suite.control import RobotState
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import RobotDescription
from wbc_suite.sensing.reading import Reading
from wbc_suite.tomlfile import read_toml

__all__ = [
    "Benchmark",
    "benchmark_names",
    "load_benchmark",
    "register_benchmark",
]


class Benchmark(Protocol):
    """A benchmark; it knows robots and objects, and no controller.

    Attributes:
        name: Its name.
        horizon: Actions in an episode, unless the user says otherwise.
        robots: Robots that are taken unless the user says otherwise.
        gripper: Gripper that they get unless the user says otherwise; None keeps
            theirs.
    """

    name: str
    horizon: int
    robots: Sequence[str]
    gripper: str | None

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return the robots standing where this benchmark wants them.

        Args:
            robots: One or several.
            configuration: `default`, `single-robot`, `opposed` or `parallel`.

        Raises:
            ConfigError: If they are too many or too few, or cannot stand so.
        """
        ...

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add furniture, objects and cameras to an empty arena."""
        ...

    def equip(self, spec: mujoco.MjSpec, robots: Sequence[RobotDescription]) -> None:
        """Add what is fixed to the robots, which are in the scene now."""
        ...

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up in the compiled scene what the other methods need."""
        ...

    def reset(self, rng: np.random.Generator) -> None:
        """Place the objects; positions and sizes are written into model and data."""
        ...

    def watch(self) -> None:
        """Note what happened in a control period, where success depends on the past.

        Notes belong into `data.userdata`, so that they are part of the state.
        """
        ...

    def observables(self) -> dict[str, Reading]:
        """Return what is seen of the objects, by key; see `wbc_suite.sensing.reading`.

        It is asked once, after `bind`.
        """
        ...

    def felt(self) -> dict[str, dict[str, Reading]]:
        """Return what robots feel of it, by robot's prefix and key; asked likewise."""
        ...

    def success(self) -> bool:
        """Whether the benchmark is solved now."""
        ...

    def reward(self, *, shaped: bool, success: bool | None = None) -> float:
        """Return a reward in [0, 1]; 1 on success.

        Args:
            shaped: Whether it also says how far a state that is no success has come.
            success: What `success` says now, where that is known.
        """
        ...


_BUILDERS: dict[str, Callable[[Path], Benchmark]] = {}


def register_benchmark(name: str, build: Callable[[Path], Benchmark]) -> None:
    """Make a benchmark known; `build` gets the path of `tasks/{name}.toml`."""
    _BUILDERS[name] = build


def benchmark_names() -> tuple[str, ...]:
    """Return the names of all benchmarks."""
    return tuple(sorted(_BUILDERS))


def load_benchmark(
    name: str | Path | Callable[[], Benchmark], catalogue: Catalogue | None = None
) -> Benchmark:
    """Make a benchmark by its name, without regard to case, or from its file.

    A class of your own, or any function that returns a benchmark, is called.

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
            raise ConfigError(f"{path}: key 'name': {error}") from error
        return _BUILDERS[known](path)
    known = _find(str(name))
    path = (catalogue or Catalogue()).find("tasks", known, kind="benchmark file")
    return _BUILDERS[known](path)


def _find(name: str) -> str:
    for known in _BUILDERS:
        if known.casefold() == name.casefold():
            return known
    raise UnknownNameError("benchmark", name, _BUILDERS)
