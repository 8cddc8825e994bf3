"""Policies by name: `hold`, `random`, `scripted`, and a user's own functions."""

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

GAIN = 8.0  # of the full action, per metre
ABOVE = 0.08  # m over the cube, for the approach
NEAR, CLOSED = 0.008, 25  # m; actions until the fingers are closed


def hold(env: RobotEnv, rng: np.random.Generator) -> Policy:
    """Make a policy that keeps all targets where they are."""
    del rng
    return lambda _: env.hold_action


def random(env: RobotEnv, rng: np.random.Generator) -> Policy:
    """Make a policy that draws every action uniformly from the action space."""
    low, high = env.action_layout.low, env.action_layout.high
    return lambda _: rng.uniform(low, high)


def scripted(env: RobotEnv, rng: np.random.Generator) -> Policy:
    """Make a policy that picks up the cube of Lift: above it, down, close, up.

    It commands differences of position, as `OSC_POSE` takes them, for one arm. Raises
    ConfigError in other environments.
    """
    names = [part.name for part in env.action_layout.slices]
    if env.benchmark.name != "Lift" or names != ["right", "right_gripper"]:
        raise ConfigError(
            "The scripted policy picks up the cube of Lift, with one arm by OSC_POSE; "
            f"it cannot drive {env.benchmark.name} with {', '.join(names)}."
        )
    del rng
    grasped = 0

    def drive(observation: Mapping[str, Any]) -> Vector:
        nonlocal grasped
        action = env.hold_action
        offset = observation["cube_pos"] - observation["robot0_eef_pos"]
        sideways = float(np.linalg.norm(offset[:2]))
        if grasped == 0 and sideways > NEAR:
            offset[2] += ABOVE
        elif grasped > 0 or abs(offset[2]) <= NEAR:
            grasped += 1
            offset = np.array([0.0, 0.0, 0.1 if grasped > CLOSED else 0.0])
        action[:3] = np.clip(GAIN * offset, -1.0, 1.0)
        action[env.action_layout.slices[1].start :] = 1.0 if grasped else -1.0
        return action

    return drive


POLICIES: Mapping[str, Callable[[RobotEnv, np.random.Generator], Policy]] = {
    "hold": hold,
    "random": random,
    "scripted": scripted,
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
