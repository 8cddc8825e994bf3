"""How an observation differs from the true value."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from wbc_suite.arguments import check_number
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

Noise: TypeAlias = Callable[[Vector, np.random.Generator], Vector]
Delay: TypeAlias = float | Callable[[np.random.Generator], float]
Filter: TypeAlias = Callable[[Vector], Vector]


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
