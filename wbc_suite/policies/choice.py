"""Policies by name."""

import importlib
from collections.abc import Callable, Mapping

import numpy as np

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.policies.policy import Policy, hold, random
from wbc_suite.policies.scripted import scripted

__all__ = ["POLICIES", "make_policy"]

POLICIES: Mapping[str, Callable[[RobotEnv, np.random.Generator], Policy]] = {
    "hold": hold,
    "random": random,
    "scripted": scripted,
}


def make_policy(name: str, env: RobotEnv, seed: int) -> Policy:
    """Make the policy of a name for one episode.

    Args:
        name: One of `POLICIES`, or `package.module:function` of your own, where the
            function takes the environment and a generator and returns the policy.
        env: What it will act in, reset.
        seed: Of the episode; the policy's own randomness follows from it.

    Raises:
        UnknownNameError: If there is no such policy.
        ConfigError: If its module or its function cannot be found, or it cannot drive
            this environment.
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
