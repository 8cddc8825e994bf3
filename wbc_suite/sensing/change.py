"""How observations differ from the true values, and what then is observed."""

import copy
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import gymnasium
import numpy as np
from numpy.typing import NDArray

from wbc_suite.arguments import check_count, check_number
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

Values: TypeAlias = NDArray[Any]
"""A vector, shape (size,), or a picture, shape (height, width, channels)."""

Noise: TypeAlias = Callable[[Vector, np.random.Generator], Vector]
Delay: TypeAlias = float | Callable[[np.random.Generator], float]
Filter: TypeAlias = Callable[[Vector], Vector]

ROUNDING = 1e-9
"""s; times of samples are multiples of physics steps."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Change:
    """How an observation differs from the true value; see `sensing.noise`.

    Attributes:
        delay: s, or a function that draws one for each sample.
        filter: Function that returns filtered values; its `reset` is called at a reset.
        sampling_rate: Samples per second; None for one per physics step, of pictures
            for one per observation.
        dropout: Share of samples that are lost; the value before stays.
        crop: Height and width, in pixels, of the middle of a picture that is observed;
            for pictures alone.
        enabled: Whether samples are taken; otherwise the last value is kept.
        active: Whether the key is part of observations and of their space.
    """

    noise: Noise | None = None
    delay: Delay = 0.0
    filter: Filter | None = None
    sampling_rate: float | None = None
    dropout: float = 0.0
    crop: tuple[int, int] | None = None
    enabled: bool = True
    active: bool = True

    def __post_init__(self) -> None:
        if not callable(self.delay):
            check_number("An observation's delay", self.delay, least=0.0)
        check_number("An observation's dropout", self.dropout, least=0.0, most=1.0)
        if self.sampling_rate is not None:
            check_number("An observation's sampling_rate", self.sampling_rate, above=0)
        for name in ("noise", "filter"):
            value = getattr(self, name)
            if value is not None and not callable(value):
                raise ConfigError(
                    f"An observation's {name} must be a function or None, "
                    f"not {value!r:.60}."
                )


@dataclass(slots=True)
class ChannelState:
    """What a channel remembers.

    Attributes:
        time: Of the last look, s; None before the first.
        due: Time of the next sample, s.
        filter: The filter with its past.
        shown: What is observed.
        coming: Samples still delayed, with the times at which they are observed.
    """

    time: float | None
    due: float
    filter: Any
    shown: Values
    coming: deque[tuple[float, Values]]


class Channel:
    """Sampling, crop, noise, filter, delay and dropout of one observation.

    Samples are taken when it is looked at: values after each physics step, pictures
    when they are drawn for an observation.

    Args:
        change: The changes.
        space: Space of the true values.
        timestep: Duration of a physics step, s; delays are rounded to steps.

    Attributes:
        space: Space of what is observed.
        state: What it remembers.

    Raises:
        ConfigError: If the crop is larger than the picture.
    """

    def __init__(
        self, change: Change, space: gymnasium.spaces.Box, timestep: float
    ) -> None:
        self.change, self.space = change, space
        self._cut: Any = ...
        if change.crop is not None:
            self._cut = _middle(change.crop, space.shape)
            low, high = space.low[self._cut], space.high[self._cut]
            self.space = gymnasium.spaces.Box(low, high, low.shape, space.dtype.type)
        self._period = 1.0 / change.sampling_rate if change.sampling_rate else 0.0
        self._early = 0.5 * timestep - ROUNDING
        self.start()

    def start(self) -> None:
        """Forget the past."""
        kept = copy.deepcopy(self.change.filter)
        reset = getattr(kept, "reset", None)
        if reset is not None:
            reset()
        self.state = ChannelState(None, -np.inf, kept, self.space.low, deque())

    def continue_from(self, old: "Channel") -> None:
        """Take over the samples of the channel before a change, and a kept filter."""
        own = self.state.filter
        self.state = old.state
        if self.change.filter is not old.change.filter:
            self.state.filter = own

    def look(self, values: Values, time: float, rng: np.random.Generator) -> Values:
        """Return what is observed of true values at a time, s; a copy.

        The first sample is taken without delay.
        """
        state = self.state
        if state.time is None:
            state.shown, state.due = values[self._cut].copy(), time + self._period
            if self.change.enabled:
                state.shown = self._taken(values, rng)
        elif time != state.time:
            self._sample(values, time, rng)
        state.time = time
        while any(due <= time + self._early for due, _ in state.coming):
            state.shown = state.coming.popleft()[1]
        return state.shown.copy()

    def _sample(self, values: Values, time: float, rng: np.random.Generator) -> None:
        """Take a sample if one is due and not lost."""
        change, state = self.change, self.state
        if not change.enabled or time < state.due - ROUNDING:
            return
        while self._period and state.due < time + ROUNDING:
            state.due += self._period
        if change.dropout > 0.0 and rng.uniform() < change.dropout:
            return
        wait = change.delay(rng) if callable(change.delay) else change.delay
        state.coming.append((time + wait, self._taken(values, rng)))

    def _taken(self, values: Values, rng: np.random.Generator) -> Values:
        sample = values[self._cut]
        change, space = self.change, self.space
        if change.noise is None and self.state.filter is None:
            return sample.copy()
        found = sample.astype(np.float64)
        if change.noise is not None:
            found = change.noise(found, rng)
        if self.state.filter is not None:
            found = self.state.filter(found)
        if np.issubdtype(sample.dtype, np.integer):
            found = np.rint(found)
        return np.clip(found, space.low, space.high).astype(sample.dtype)


def _middle(crop: tuple[int, int], shape: tuple[int, ...]) -> tuple[slice, ...]:
    """Return the rows and columns in the middle of a picture."""
    sizes = [check_count("An observation's crop", x, least=1) for x in crop]
    if len(sizes) != 2 or any(x > most for x, most in zip(sizes, shape, strict=False)):
        raise ConfigError(
            f"An observation's crop is {crop}; it must be height and width, at most "
            f"those of the picture, {shape[0]} and {shape[1]}."
        )
    starts = [(most - x) // 2 for x, most in zip(sizes, shape, strict=False)]
    return tuple(slice(s, s + x) for s, x in zip(starts, sizes, strict=True))
