"""Observations that are sampled, delayed, noisy, filtered, added or left out.

Unchanged observations are read once a control period, changed ones after every physics
step. Pictures are drawn when they are observed, and changed by `Cameras`.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeAlias, cast

import gymnasium
import mujoco
import numpy as np

from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.sensing.cameras import Cameras
from wbc_suite.sensing.change import Change, Channel
from wbc_suite.sensing.observation_buffer import ObservationBuffer
from wbc_suite.sensing.reading import Reading

Maker: TypeAlias = Callable[[mujoco.MjModel, mujoco.MjData], Reading]


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
        self._channels: dict[str, Channel] = {}
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
        for channel in self._channels.values():
            channel.start()
        self.sample()
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
        time = float(self._data.time)
        for key, channel in self._channels.items():
            channel.look(self.buffer.values[self.buffer.places[key]], time, self._rng)

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
        for key, channel in self._channels.items():
            self.buffer.values[self.buffer.places[key]] = channel.state.shown

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
        space = cast("gymnasium.spaces.Box", self.buffer.space[key])
        channel = Channel(change, space, self._model.opt.timestep)
        if old is None:
            values = self.buffer.values[self.buffer.places[key]]
            channel.look(values, float(self._data.time), self._rng)
        else:
            channel.continue_from(old)
        self._channels[key] = channel
