"""What a policy is, and the two that every environment has."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from wbc_suite.envs import RobotEnv
from wbc_suite.typing import Vector

__all__ = ["Policy", "hold", "random"]

Policy: TypeAlias = Callable[[Mapping[str, Any]], Vector]
"""From an observation to an action of `env.action_space`; made for each episode."""


def hold(env: RobotEnv, rng: np.random.Generator) -> Policy:
    """Make a policy that keeps all goals."""
    del rng
    return lambda _: env.hold_action


def random(env: RobotEnv, rng: np.random.Generator) -> Policy:
    """Make a policy that draws every action evenly from the action space."""
    low, high = env.action_layout.low, env.action_layout.high
    return lambda _: rng.uniform(low, high)
