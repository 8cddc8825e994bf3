"""Physics states: vectors from which an environment restores a world.

The parts of a vector, in this order:

| part | numbers |
|---|---|
| physics | MuJoCo's `mjSTATE_INTEGRATION`: time, qpos, qvel, and more |
| memory | what laws and controllers go on from, see `Simulation.memory` |
| waiting | actions that a latency delays |
| origin | what the scene was drawn with, and what it belongs to, see `Origin` |

Time, qpos and qvel alone, as in robosuite's datasets, are a physics state too. It does
not say what the scene drew and what the controllers were doing.
"""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel

from wbc_suite.arguments import check_array
from wbc_suite.envs.simulation import Simulation
from wbc_suite.envs.states import (
    ORIGIN,
    PHYSICS,
    motion_size,
    physics_size,
    write_physics,
)
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Matrix, Vector

WORDS = 10
"""Numbers of a generator's state."""

_SHIFTS = (0, 32, 64, 96)

DRAWN = (
    *("body_pos", "body_quat", "body_mass", "body_inertia", "geom_pos", "geom_quat"),
    *("geom_size", "geom_friction", "site_pos", "jnt_range", "dof_damping"),
)
"""Arrays of a model in which what a scene draws is looked for."""


class Origin(NamedTuple):
    """Where a physics state comes from; all are whole numbers below 2^48.

    Generators are PCG64, as `words_of` gives them.

    Attributes:
        scene_generator: The generator before it drew the scene.
        randomisation_generator: The generator before it drew the randomisation.
        drawn: Digest of what the scene drew.
        randomisation: Digest of what the randomisation may draw; 0 without any.
        controllers: Digest of what memory and waiting actions belong to.
        scene: Digest of bodies and joints.
    """

    scene_generator: tuple[int, ...]
    randomisation_generator: tuple[int, ...]
    drawn: int
    randomisation: int
    controllers: int
    scene: int

    @classmethod
    def parse(cls, values: Vector) -> "Origin":
        """Return the origin of a physics state, or raise ConfigError."""
        found = values[-ORIGIN:]
        numbers = [int(x) for x in np.clip(found, 0.0, 2.0**48)]
        if (found != numbers).any() or max(numbers[: 2 * WORDS]) >= 1 << 32:
            raise ConfigError("A physics state ends with numbers that cannot be.")
        first, second = numbers[:WORDS], numbers[WORDS : 2 * WORDS]
        return cls(tuple(first), tuple(second), *numbers[2 * WORDS :])

    @property
    def values(self) -> tuple[int, ...]:
        """All numbers."""
        return *self.scene_generator, *self.randomisation_generator, *self[2:]


def words_of(generator: np.random.Generator) -> tuple[int, ...]:
    """Return the state of a PCG64 generator in 32-bit words."""
    state: Any = generator.bit_generator.state
    numbers = state["state"]["state"], state["state"]["inc"]
    words = [number >> shift & 0xFFFFFFFF for number in numbers for shift in _SHIFTS]
    return *words, state["has_uint32"], state["uinteger"]


def generator_of(words: Sequence[int]) -> np.random.Generator:
    """Return the PCG64 generator whose state has these 32-bit words."""
    state, inc = (
        sum(word << shift for word, shift in zip(part, _SHIFTS, strict=True))
        for part in (words[:4], words[4:8])
    )
    generator = np.random.default_rng(0)
    generator.bit_generator.state = {
        "bit_generator": "PCG64",
        "state": {"state": state, "inc": inc},
        "has_uint32": words[8],
        "uinteger": words[9],
    }
    return generator


def digest(*parts: bytes | str) -> int:
    """Return 48 bits of a hash, which a float64 holds exactly."""
    found = hashlib.blake2b(digest_size=6)
    for part in parts:
        found.update(part.encode() if isinstance(part, str) else part)
        found.update(b"\0")
    return int.from_bytes(found.digest(), "little")


def scene_digest(model: mujoco.MjModel) -> int:
    """Return a digest of names and kinds of bodies and joints."""
    bodies = [model.body(k).name for k in range(model.nbody)]
    joints = [model.joint(k).name for k in range(model.njnt)]
    kinds = model.jnt_type.tobytes() + model.body_parentid.tobytes()
    return digest(*bodies, "", *joints, kinds, str(model.nuserdata))


class Draws:
    """What a scene draws into its model at a reset, to compare it.

    Args:
        model: The model before a scene has drawn into it the first time.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._before = {name: getattr(model, name).copy() for name in DRAWN}
        self._places: dict[str, Any] | None = None

    def digest(self) -> int:
        """Return a digest of the values that the scene has just drawn, 0 for none.

        The first call finds their places. Values are rounded, since the last bit of
        sines and cosines depends on the processor.
        """
        if self._places is None:
            changed = {n: getattr(self._model, n) != x for n, x in self._before.items()}
            self._places = {n: x.nonzero() for n, x in changed.items() if x.any()}
        drawn = [getattr(self._model, n)[x] for n, x in self._places.items()]
        rounded = [(np.round(x, 8) + 0.0).tobytes() for x in drawn]
        return digest(*rounded) if rounded else 0


@dataclass(frozen=True, kw_only=True, slots=True)
class SavedState:
    """A physics state, taken apart.

    Attributes:
        values: The whole vector.
        origin: Where it comes from; None if it is time, qpos and qvel alone.
        memory: What controllers go on from; None if they are others.
        waiting: Rows of physics steps until an action takes effect, and the action.
    """

    values: Vector
    origin: Origin | None = None
    memory: Vector | None = None
    waiting: Matrix | None = None


class PhysicsStates:
    """Writes, reads and compares the physics states of an environment.

    Args:
        simulation: Its simulation; nothing was drawn into the model yet.
        randomisation: What draws properties of the scene, or None.
        actions: Number of values of an action.
    """

    def __init__(
        self, simulation: Simulation, randomisation: object, actions: int
    ) -> None:
        self._simulation, self._columns = simulation, 1 + actions
        self._draws = Draws(simulation.model)
        self._size = physics_size(simulation.model)
        self._scene = scene_digest(simulation.model)
        self._controllers = _controllers_digest(simulation)
        self._randomisation = _randomisation_digest(randomisation)
        none = (0,) * WORDS
        self._origin = Origin(none, none, 0, 0, self._controllers, self._scene)

    def read(self, state: ArrayLike) -> SavedState:
        """Take a physics state apart.

        Raises:
            ConfigError: If it is of another scene, or no physics state.
        """
        model, size = self._simulation.model, self._size
        values = np.array(check_array("A physics state", state, None))
        if values.shape == (motion_size(model),):
            return SavedState(values=values)
        if values.ndim != 1 or values.size < ORIGIN or values[-1] != self._scene:
            raise ConfigError(
                f"A physics state has shape {values.shape} and is not of this scene: "
                "its bodies or joints have other names, or numbers are missing. Make "
                "the environment with the benchmark, the robots and the arena that it "
                "was taken in."
            )
        origin, end = Origin.parse(values), size + self._simulation.memory.size
        if origin.controllers != self._controllers:
            return SavedState(values=values, origin=origin)
        rest = values[end:-ORIGIN]
        if values.size < end + ORIGIN or rest.size % self._columns:
            raise ConfigError(
                f"A physics state has {values.size} numbers; {end + ORIGIN} were "
                "expected."
            )
        waiting = rest.reshape(-1, self._columns)
        return SavedState(
            values=values,
            origin=origin,
            memory=values[size:end],
            waiting=waiting[waiting[:, 0] >= 0.0],
        )

    def write(self, waiting: Iterable[tuple[int, Vector]], slots: int) -> Vector:
        """Return the present physics state, with room for so many waiting actions."""
        simulation = self._simulation
        physics = np.empty(self._size)
        mujoco.mj_getState(simulation.model, simulation.data, physics, PHYSICS)
        rows = np.zeros((slots, self._columns))
        rows[:, 0] = -1.0
        for row, (left, action) in zip(rows, waiting, strict=False):
            row[0], row[1:] = left, action
        memory, origin = simulation.memory.read(), self._origin.values
        return np.concatenate([physics, memory, rows.ravel(), origin])

    def scene_generator(
        self, saved: SavedState | None, rng: np.random.Generator
    ) -> np.random.Generator:
        """Return what draws the scene: as for the saved state, or `rng`."""
        if saved is not None and saved.origin is not None:
            rng = generator_of(saved.origin.scene_generator)
        elif not isinstance(rng.bit_generator, np.random.PCG64):
            rng = np.random.default_rng(rng.integers(1 << 63, size=4))
        self._origin = self._origin._replace(scene_generator=words_of(rng))
        return rng

    def compare_draws(self, saved: SavedState | None) -> None:
        """Note what the scene has drawn.

        Raises:
            ConfigError: If a saved state's scene has drawn something else.
        """
        drawn = self._draws.digest()
        self._origin = self._origin._replace(drawn=drawn)
        origin = None if saved is None else saved.origin
        if origin is not None and origin.drawn != drawn:
            raise ConfigError(
                "A physics state is of a scene that draws poses and sizes of objects "
                "otherwise: with another sampler, or in another release. Its qpos "
                "would be a different world here. Call reset, and make the environment "
                "as the one that it was taken in; or give time, qpos and qvel alone."
            )

    def randomisation_generator(
        self, saved: SavedState | None, rng: np.random.Generator
    ) -> np.random.Generator:
        """Return what draws the randomisation.

        As for the saved state if it has the same randomisation, else `rng`.
        """
        own, origin = self._randomisation, None if saved is None else saved.origin
        if origin is not None and origin.randomisation == own:
            rng = generator_of(origin.randomisation_generator)
        elif not isinstance(rng.bit_generator, np.random.PCG64):
            rng = np.random.default_rng(rng.integers(1 << 63, size=4))
        self._origin = self._origin._replace(
            randomisation_generator=words_of(rng), randomisation=own
        )
        return rng

    def resume(self, saved: SavedState) -> None:
        """Go on from a saved state, after the simulation has started there."""
        simulation = self._simulation
        write_physics(simulation.model, simulation.data, saved.values)
        if saved.memory is not None:
            simulation.resume(saved.memory)


def _controllers_digest(simulation: Simulation) -> int:
    """Return a digest of what the memory of a simulation's controllers means."""
    parts = [repr(simulation.timestep), repr(simulation.memory.sizes)]
    for controller in simulation.controllers:
        kind, config = type(controller), getattr(controller, "config", None)
        parts += [f"{kind.__module__}.{kind.__qualname__}", repr(config)]
        parts += [f"{type(law).__qualname__}: {law.joints}" for law in controller.laws]
    return digest(*parts)


def _randomisation_digest(randomisation: object) -> int:
    """Return a digest of what a randomisation draws; of a user's own its class."""
    if randomisation is None:
        return 0
    kind = type(randomisation)
    numbers = repr(randomisation) if isinstance(randomisation, BaseModel) else ""
    return digest(kind.__module__, kind.__qualname__, numbers)
