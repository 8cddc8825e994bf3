"""Terms of one's own in a shaped reward: `[[term]]` in a benchmark's file.

[[term]]
type = "near" # a registered name
weight = 0.1
thing = "cube" # the other keys are arguments
scale = 10.0 # 1/m
"""

import inspect
import math
from collections.abc import Callable
from typing import Any, ClassVar

from pydantic import model_validator

from wbc_suite.config_files import FrozenModel
from wbc_suite.errors import UnknownNameError, look_up
from wbc_suite.registry import Registry
from wbc_suite.robot.shapes import Real

REWARD_TERMS: Registry[Callable[..., float]] = Registry("reward term")
"""Functions by name, of the benchmark bound to its scene, and of the table's keys."""

register_reward_term = REWARD_TERMS.register


class TermConfig(FrozenModel, extra="allow"):
    """One term: the `type` is a registered name, and unknown keys are its arguments."""

    type: str
    weight: Real = 1.0

    @model_validator(mode="after")
    def _has_its_arguments(self) -> "TermConfig":
        try:
            inspect.signature(REWARD_TERMS[self.type]).bind(None, **self.arguments)
        except (UnknownNameError, TypeError) as error:
            raise ValueError(f"reward term '{self.type}': {error}") from error
        return self

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of the term beside the benchmark."""
        return dict(self.model_extra or {})

    def value(self, benchmark: Any) -> float:
        """Return what the term adds to the shaped reward now."""
        return self.weight * REWARD_TERMS[self.type](benchmark, **self.arguments)


class SharesOfOne(FrozenModel):
    """Numbers of a reward of which some, its largest parts, sum to less than 1."""

    shares: ClassVar[tuple[str, ...]]

    @model_validator(mode="after")
    def _stay_below_one(self) -> "SharesOfOne":
        if sum(getattr(self, name) for name in self.shares) >= 1.0:
            raise ValueError(f"{' + '.join(self.shares)} must be below 1")
        return self


def near(benchmark: Any, *, thing: str, scale: float = 10.0) -> float:
    """Return 1 - tanh(scale d); d is the distance of the nearest hand to a thing, m."""
    state = look_up("thing", thing, benchmark.states)
    return 1.0 - math.tanh(scale * benchmark.distance(state.position))


def held(benchmark: Any, *, thing: str) -> float:
    """Return 1 while a hand holds a thing, else 0."""
    look_up("thing", thing, benchmark.states)
    return float(benchmark.scene.held(thing))


register_reward_term("near", near)
register_reward_term("held", held)
