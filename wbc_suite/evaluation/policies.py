"""Policies by name: `expert`, `hold`, `random`, and a user's own functions."""

import importlib
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.experts import expert
from wbc_suite.typing import Vector

Policy: TypeAlias = Callable[[Mapping[str, Any]], Vector]
"""From an observation to an action of `env.action_space`; made for each episode."""


def hold(env: RobotEnv, rng: np.random.Generator) -> Policy:
    """Make a policy that keeps all targets where they are."""
    del rng
    return lambda _: env.hold_action


def random(env: RobotEnv, rng: np.random.Generator) -> Policy:
    """Make a policy that draws every action uniformly from the action space."""
    low, high = env.action_layout.low, env.action_layout.high
    return lambda _: rng.uniform(low, high)


POLICIES: Mapping[str, Callable[[RobotEnv, np.random.Generator], Policy]] = {
    "hold": hold,
    "random": random,
    "expert": expert,
}


def make_policy(name: str, env: RobotEnv, seed: int) -> Policy:
    """Make a policy for one episode of an environment that was reset.

    The name is one of `POLICIES`, or `package.module:function` of your own, where the
    function takes the environment and a generator, which follows from the seed of the
    episode, and returns the policy.

    Raises:
        UnknownNameError: If there is no such policy.
        ConfigError: If its function cannot be found, or it cannot drive this one.
    """
    rng = np.random.default_rng([seed, 1])
    if ":" not in name:
        if name not in POLICIES:
            raise UnknownNameError("policy", name, (*POLICIES, "package.module:name"))
        return POLICIES[name](env, rng)
    module, _, function = name.partition(":")
    try:
        make = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise ConfigError(
            f"The policy '{name}' cannot be found: {error}. It reads package.module:"
            "function; the module must be importable (PYTHONPATH) by every worker."
        ) from error
    return make(env, rng)
