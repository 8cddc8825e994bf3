"""Pictures that are sampled, delayed, noisy, filtered, cropped or lost."""

import copy
from collections import deque
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from wbc_suite.arguments import check_count
from wbc_suite.errors import ConfigError
from wbc_suite.sensing.change import Change

Picture = NDArray[Any]

ROUNDING = 1e-9
"""s; times of samples are multiples of physics steps."""


@dataclass(slots=True)
class PictureState:
    """What a channel remembers.

    Attributes:
        time: Of the last look, s; None before the first.
        due: Time of the next sample, s.
        filter: The filter with its past.
        shown: The picture that is observed.
        coming: Samples still delayed, with the times at which they are observed.
    """

    time: float | None
    due: float
    filter: Any
    shown: Picture | None
    coming: deque[tuple[float, Picture]]


class PictureChannel:
    """Sampling, crop, noise, filter, delay and dropout of one observed picture.

    A picture is drawn for each observation, so samples are taken at those times.

    Args:
        change: The changes.
        space: Space of the picture as it is drawn.

    Attributes:
        space: Space of the picture as it is observed.
        state: What it remembers.

    Raises:
        ConfigError: If the crop is larger than the picture.
    """

    def __init__(self, change: Change, space: gymnasium.spaces.Box) -> None:
        self.change, self._rows, self._columns = change, slice(None), slice(None)
        self.space = space
        if change.crop is not None:
            self._rows, self._columns = _middle(change.crop, space.shape)
            low, high = (x[self._rows, self._columns] for x in (space.low, space.high))
            self.space = gymnasium.spaces.Box(low, high, low.shape, space.dtype.type)
        self._period = 1.0 / change.sampling_rate if change.sampling_rate else 0.0
        self.start()

    def start(self) -> None:
        """Forget the past."""
        kept = copy.deepcopy(self.change.filter)
        reset = getattr(kept, "reset", None)
        if reset is not None:
            reset()
        self.state = PictureState(None, -np.inf, kept, None, deque())

    def show(self, drawn: Picture, time: float, rng: np.random.Generator) -> Picture:
        """Return what is observed at a time, s, of a picture that was just drawn."""
        state = self.state
        if state.shown is None:  # as for other observations, without delay
            state.shown = self._taken(drawn, rng)
            state.due = time + self._period
        elif time != state.time:
            self._sample(drawn, time, rng)
        state.time = time
        while state.coming and state.coming[0][0] <= time + ROUNDING:
            state.shown = state.coming.popleft()[1]
        return state.shown.copy()

    def _sample(self, drawn: Picture, time: float, rng: np.random.Generator) -> None:
        """Take a sample if one is due and not lost."""
        change, state = self.change, self.state
        if not change.enabled or time < state.due - ROUNDING:
            return
        state.due = max(state.due + self._period, time)
        if change.dropout > 0.0 and rng.uniform() < change.dropout:
            return
        wait = change.delay(rng) if callable(change.delay) else change.delay
        state.coming.append((time + wait, self._taken(drawn, rng)))

    def _taken(self, drawn: Picture, rng: np.random.Generator) -> Picture:
        sample = drawn[self._rows, self._columns]
        change, space = self.change, self.space
        if change.noise is None and self.state.filter is None:
            return sample.copy()
        values = sample.astype(np.float64)
        if change.noise is not None:
            values = change.noise(values, rng)
        if self.state.filter is not None:
            values = self.state.filter(values)
        if np.issubdtype(sample.dtype, np.integer):
            values = np.rint(values)
        return np.clip(values, space.low, space.high).astype(sample.dtype)


def _middle(crop: tuple[int, int], shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Return the rows and columns in the middle of a picture."""
    sizes = [check_count("An observation's crop", x, least=1) for x in crop]
    if len(sizes) != 2 or any(x > most for x, most in zip(sizes, shape, strict=False)):
        raise ConfigError(
            f"An observation's crop is {crop}; it must be height and width, at most "
            f"those of the picture, {shape[0]} and {shape[1]}."
        )
    starts = [(most - x) // 2 for x, most in zip(sizes, shape, strict=False)]
    first, second = (slice(s, s + x) for s, x in zip(starts, sizes, strict=True))
    return first, second
