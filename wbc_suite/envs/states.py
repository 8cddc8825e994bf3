"""States of an environment: an episode up to now, and a place to begin at."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.arguments import check_array
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

__all__ = ["EnvState", "Randomiser", "write_physics", "write_scene"]


@dataclass(frozen=True, kw_only=True, slots=True)
class EnvState:
    """An episode up to now: how it began, and what was done.

    Solvers and controllers cannot be copied, and an episode is determined by its start
    and its actions. It can be pickled.

    Attributes:
        began_with: State of the random generator at the start.
        placed: Physics state that it began at, if it was told one.
        taken: Actions since then.
        observables: What of observations is not determined by these.
        rng: The random generator as it is now.
        seed: What it was seeded with.
    """

    began_with: Mapping[str, Any]
    placed: Vector | None
    taken: tuple[Vector, ...]
    observables: dict[str, Any]
    rng: np.random.Generator | None
    seed: int | None


class Randomiser(Protocol):
    """Changes a scene at the start of each episode; can be pickled."""

    def bind(self, env: Any) -> "BoundRandomiser":
        """Take one environment as it is now for the nominal one."""
        ...


class BoundRandomiser(Protocol):
    """A randomiser of one environment."""

    def restore(self) -> None:
        """Put everything back."""
        ...

    def apply(self, rng: np.random.Generator) -> None:
        """Draw everything anew, in a scene that is nominal but for the benchmark."""
        ...


def write_physics(model: mujoco.MjModel, data: mujoco.MjData, state: ArrayLike) -> None:
    """Write a physics state as datasets of this field have it: time, qpos, qvel.

    Raises:
        ConfigError: If its size is wrong or a value is not finite.
    """
    size = 1 + model.nq + model.nv
    values = check_array("A physics state", state, (size,))
    if not np.isfinite(values).all():
        raise ConfigError("A physics state must be finite.")
    data.time = values[0]
    data.qpos[:], data.qvel[:] = np.split(values[1:], [model.nq])


def write_scene(spec: mujoco.MjSpec) -> str:
    """Write a scene as MJCF text; computed textures become plain, MJCF has no word."""
    for texture in spec.textures:
        if len(texture.data):
            texture.data = b""
            texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_FLAT
            texture.rgb1 = texture.rgb2 = (0.77, 0.61, 0.44)
    spec.compile()
    return spec.to_xml()
