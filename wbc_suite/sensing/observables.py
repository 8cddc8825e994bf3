"""Observations that are sampled, delayed, noisy, filtered, added or left out.

Unchanged observations are read once a control period, changed ones after every physics
step. Pictures are drawn when they are observed, and changed by `Cameras`.
"""

import copy
import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import mujoco
import numpy as np

from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.sensing.cameras import Cameras
from wbc_suite.sensing.change import Change
from wbc_suite.sensing.observation_buffer import ObservationBuffer
from wbc_suite.sensing.reading import Reading
from wbc_suite.typing import Vector

Maker: TypeAlias = Callable[[mujoco.MjModel, mujoco.MjData], Reading]

ROUNDING = 1e-6  # samples


class Observables:
    """All observations of one simulation but pictures, by key, by the group's key.

    Changes of the pictures that `cameras` observes are made here too.

    Attributes:
        buffer: The last observation; a new one after keys were added or removed.
        changes: Changes of observations, by key.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        groups: Mapping[str, Mapping[str, Reading]],
        cameras: Cameras | None = None,
    ) -> None:
        self._model, self._data, self._cameras = model, data, cameras
        self._groups = {name: dict(group) for name, group in groups.items()}
        self._added: dict[str, tuple[str, Maker]] = {}
        self.changes: dict[str, Change] = {}
        self._channels: dict[str, _Channel] = {}
        self._rng = np.random.default_rng(0)
        self.buffer = ObservationBuffer(data, self._groups)

    @property
    def names(self) -> tuple[str, ...]:
        """Keys of all observations, inactive ones and pictures included."""
        own = tuple(key for group in self._groups.values() for key in group)
        return *own, *(self._cameras.observed if self._cameras else ())

    def modify(self, key: str, **changes: Any) -> None:
        """Change an observation from now on; see `Change`.

        Raises:
            UnknownNameError: If there is no such observation, or no such change.
            ConfigError: If a value is wrong; then nothing has changed.
        """
        if key not in self.names:
            raise UnknownNameError("observation", key, self.names)
        for name in changes:
            if name not in Change.__slots__:
                raise UnknownNameError("change", name, tuple(Change.__slots__))
        before = self.changes.get(key, Change())
        now = replace(before, **changes)
        if self._cameras is not None and key in self._cameras.observed:
            self._cameras.change(key, None if now == Change() else now)
        elif now.crop is not None:
            raise ConfigError(f"'{key}' is no picture, so it has no crop.")
        self.changes[key] = now
        if now == Change():
            del self.changes[key]
        if self._cameras is not None and key in self._cameras.observed:
            return
        if now.active != before.active:
            self._rebuild()
        self._connect(key)

    def add(self, key: str, make: Maker, *, group: str, **changes: Any) -> None:
        """Add an observation with a new key from now on; for `changes` see `modify`.

        `make` returns the reading of model and data; copies of the environment call it
        again. `group` is the key of the vector that includes it; it may be new.

        Raises:
            ConfigError: If the key is taken.
        """
        if key in self.names or key in self._groups or key == group:
            raise ConfigError(f"There is an observation '{key}' already.")
        self._groups.setdefault(group, {})[key] = make(self._model, self._data)
        self._added[key] = group, make
        self._rebuild()
        if changes:
            self.modify(key, **changes)

    def start(self, rng: np.random.Generator) -> None:
        """Start an episode; noise is drawn from a generator that `rng` seeds."""
        if self.changes:
            self._rng = np.random.default_rng(rng.integers(2**63))
        self.buffer.update()
        for channel in self._channels.values():
            channel.start(self.buffer.values, self._rng)
        if self._cameras is not None:
            self._cameras.start(self._rng)
        self._show()

    @property
    def follows_physics(self) -> bool:
        """Whether `sample` must be called after every physics step."""
        return bool(self._channels)

    def sample(self) -> None:
        """Take the samples of changed observations after one physics step."""
        self.buffer.update()
        for channel in self._channels.values():
            channel.sample(self.buffer.values, self._rng)

    def update(self) -> None:
        """Read everything into `buffer.values`, with the changes applied."""
        self.buffer.update()
        self._show()

    def state(self) -> dict[str, Any]:
        """Return the state that `prepare` and `restore` take."""
        return {
            "added": self._added,
            "changes": self.changes,
            "channels": {k: c.state for k, c in self._channels.items()},
            "rng": self._rng,
            "pictures": self._cameras.state() if self._cameras else None,
        }

    def prepare(self, state: Mapping[str, Any]) -> None:
        """Add and change the same observations as the original."""
        for key, (group, make) in state["added"].items():
            self.add(key, make, group=group)
        for key, change in state["changes"].items():
            if change != self.changes.get(key):
                self.modify(key, **{k: getattr(change, k) for k in Change.__slots__})

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from the state of the original."""
        self._rng = state["rng"]
        for key, saved in state["channels"].items():
            if key in self._channels:
                self._channels[key].state = saved
        if self._cameras is not None and state["pictures"] is not None:
            self._cameras.restore(state["pictures"])
        self.update()

    def _show(self) -> None:
        for channel in self._channels.values():
            channel.show(self.buffer.values)

    def _rebuild(self) -> None:
        """Make a buffer of the active observations."""
        groups = {
            name: {
                key: reading
                for key, reading in group.items()
                if key not in self.changes or self.changes[key].active
            }
            for name, group in self._groups.items()
        }
        self.buffer = ObservationBuffer(self._data, groups)
        for channel in list(self._channels):
            self._connect(channel)
        self.update()

    def _connect(self, key: str) -> None:
        """Make the channel of an observation that is changed."""
        change, old = self.changes.get(key), self._channels.pop(key, None)
        if change is None or not change.active:
            return
        place, bound = self.buffer.places[key], self.buffer.bounds[key]
        channel = _Channel(change, place, bound, self._model.opt.timestep)
        if old is None:
            channel.start(self.buffer.values, self._rng)
        else:
            channel.continue_from(old)
        self._channels[key] = channel


class _Channel:
    """Sampling, noise, filter and delay of one observation."""

    def __init__(
        self, change: Change, place: slice, bound: float, timestep: float
    ) -> None:
        self._change, self._place, self._bound = change, place, bound
        self._timestep, self._step = timestep, 0
        rate = change.sampling_rate
        self._samples_per_step = 1.0 if rate is None else min(1.0, rate * timestep)
        self._filter = copy.deepcopy(change.filter)
        self._shown: Vector = np.zeros(place.stop - place.start)
        self._coming: deque[tuple[int, Vector]] = deque()

    @property
    def state(self) -> tuple[Any, ...]:
        """Step count, filter, shown values and samples still delayed."""
        return self._step, self._filter, self._shown, self._coming

    @state.setter
    def state(self, saved: tuple[Any, ...]) -> None:
        self._step, self._filter, self._shown, self._coming = saved

    def continue_from(self, old: "_Channel") -> None:
        """Take over the samples of the channel before a change, and a kept filter."""
        own = self._filter
        self.state = old.state
        if self._change.filter is not old._change.filter:
            self._filter = own

    def start(self, values: Vector, rng: np.random.Generator) -> None:
        """Take a first sample without delay."""
        self._step, self._coming = 0, deque()
        reset = getattr(self._filter, "reset", None)
        if reset is not None:
            reset()
        self._shown = values[self._place].copy()
        if self._change.enabled:
            self._shown = self._taken(values, rng)

    def sample(self, values: Vector, rng: np.random.Generator) -> None:
        """Take a sample if one is due, and release those whose delay is over."""
        self._step += 1
        if self._change.enabled and self._is_due() and self._kept(rng):
            delay = self._change.delay
            wait = delay(rng) if callable(delay) else delay
            due = self._step + round(wait / self._timestep)
            self._coming.append((due, self._taken(values, rng)))
        while any(due <= self._step for due, _ in self._coming):
            self._shown = self._coming.popleft()[1]

    def _kept(self, rng: np.random.Generator) -> bool:
        """Return whether a sample is not lost."""
        dropout = self._change.dropout
        return not dropout or rng.uniform() >= dropout

    def _is_due(self) -> bool:
        """Return whether a sample falls into the last step; on average at the rate."""
        before, after = (
            math.floor(step * self._samples_per_step + ROUNDING)
            for step in (self._step - 1, self._step)
        )
        return after > before

    def show(self, values: Vector) -> None:
        """Write the observed values over the true ones."""
        values[self._place] = self._shown

    def _taken(self, values: Vector, rng: np.random.Generator) -> Vector:
        sample = values[self._place].copy()
        if self._change.noise is not None:
            sample = self._change.noise(sample, rng)
        if self._filter is not None:
            sample = self._filter(sample)
        return np.clip(np.asarray(sample, np.float64), -self._bound, self._bound)
