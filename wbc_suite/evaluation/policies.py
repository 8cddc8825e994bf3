"""Policies by name: our own, a user's own functions and classes, and served ones."""

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.evaluation.policy_socket import SCHEME, SocketPolicy
from wbc_suite.experts import Multiplied, expert
from wbc_suite.registry import Registry
from wbc_suite.typing import Vector

Policy: TypeAlias = Callable[[Mapping[str, Any]], Vector]
"""From an observation to an action of `env.action_space`; made for each episode."""

RECORDING = ".hdf5"


def hold(env: RobotEnv, rng: np.random.Generator) -> Policy:
    """Make a policy that keeps all targets where they are."""
    del rng
    return lambda _: env.hold_action


def random(env: RobotEnv, rng: np.random.Generator) -> Policy:
    """Make a policy that draws every action uniformly from the action space."""
    low, high = env.action_layout.low, env.action_layout.high
    return lambda _: rng.uniform(low, high)


PolicyMaker: TypeAlias = Callable[[RobotEnv, np.random.Generator], Policy]

POLICIES: Registry[PolicyMaker] = Registry("policy")
"""Functions or classes that make the policy of an episode, by name.

They get the environment, which was reset, and a generator that follows from the seed of
the episode.
"""

register_policy = POLICIES.register
register_policy("hold", hold)
register_policy("random", random)
register_policy("expert", expert)


def check_policy(name: str, devices: Collection[str] = ()) -> None:
    """Raise what `make_policy` would raise for a name, before there is an environment.

    The message of an unknown name lists `devices`, too.
    """
    if name.endswith(RECORDING) and not Path(name).is_file():
        raise ConfigError(
            f"The policy '{name}' cannot be found: there is no such file."
        )
    if not name.startswith(SCHEME) and not name.endswith(RECORDING):
        _maker(name, devices)


def _maker(name: str, devices: Collection[str] = ()) -> PolicyMaker:
    try:
        return POLICIES.find(name)
    except UnknownNameError:
        known = (*POLICIES, *devices, "package.module:Name", "FILE.hdf5")
        kind = "policy or device" if devices else "policy"
        raise UnknownNameError(kind, name, known) from None


def make_policy(name: str, env: RobotEnv, seed: int) -> Policy:
    """Make a policy for one episode of an environment that was reset.

    The name is one of `POLICIES`, or `package.module:Name` of your own;
    `socket://HOST:PORT` of a `PolicyServer`; or a
    recording, `FILE.hdf5`, whose episodes are moved to the scene, see `Multiplied`. A
    policy with a method `close` is closed after its episode, and one whose attribute
    `finished` becomes true ends it.

    Raises:
        UnknownNameError: If there is no such policy.
        ConfigError: If it cannot be found, or cannot drive this environment.
        DatasetError: If the recording cannot be used here.
        DeviceError: If its server cannot be reached, or fails.
    """
    if name.startswith(SCHEME):
        return SocketPolicy(name, describe(env, seed))
    rng = np.random.default_rng([seed, 1])
    if name.endswith(RECORDING):
        return Multiplied(Path(name), env, rng)
    return _maker(name)(env, rng)


def describe(env: RobotEnv, seed: int) -> dict[str, Any]:
    """Return what a served policy is told of an episode, plain JSON data."""
    benchmark, arguments = env.made_of
    layout = env.action_layout
    return {
        "seed": seed,
        "benchmark": str(benchmark),
        "instruction": env.instruction,
        **{key: _plain(value) for key, value in arguments.items()},
        "action": {
            "parts": {p.name: [p.start, p.stop] for p in layout.slices},
            "low": layout.low.tolist(),
            "high": layout.high.tolist(),
        },
    }


def _plain(value: Any) -> Any:
    """Return an argument of `make` as JSON data."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value if isinstance(value, str | int | float | None) else str(value)


def replicate(
    name: str, *, trust_files: bool = False
) -> Callable[[Mapping[str, Any]], Policy]:
    """Return what a `PolicyServer` begins episodes with, for a policy of this machine.

    The policy acts in an environment of its own, made and stepped like the client's:
    so policies that read the simulation can be served too, and every action is, bit for
    bit, the one that the policy takes without a socket. With `trust_files`, clients may
    name files of this machine, such as those of robots.
    """
    from wbc_suite.recording import EnvSource

    def begin(episode: Mapping[str, Any]) -> Policy:
        told = "action", "instruction"
        given = {key: value for key, value in episode.items() if key not in told}
        seed, benchmark = int(given.pop("seed")), str(given.pop("benchmark"))
        source = EnvSource(benchmark=benchmark, arguments=given)
        env = source.build(trust_files=trust_files)
        env.reset(seed=seed)
        return Replica(env, make_policy(name, env, seed))

    return begin


class Replica:
    """A policy in an environment of its own, which makes the same steps as another."""

    def __init__(self, env: RobotEnv, policy: Policy) -> None:
        self._env, self._policy = env, policy
        self._taken: Vector | None = None

    def __call__(self, observation: Mapping[str, Any]) -> Vector:
        """Return the policy's next action."""
        if self._taken is not None:
            self._env.step(self._taken)
        self._taken = np.array(self._policy(observation), dtype=np.float64)
        return self._taken

    def close(self) -> None:
        """Close the environment."""
        self._env.close()
