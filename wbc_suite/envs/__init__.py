"""Environments: robots, controllers and benchmarks behind the Gymnasium API."""

from collections.abc import Callable
from pathlib import Path
from typing import Unpack

from wbc_suite.benchmark import Benchmark
from wbc_suite.envs.config import EnvArguments
from wbc_suite.envs.env import RobotEnv
from wbc_suite.envs.simulation import Simulation
from wbc_suite.envs.vector import VectorRobotEnv

__all__ = ["RobotEnv", "Simulation", "VectorRobotEnv", "make"]


def make(
    benchmark: str | Path | Callable[[], Benchmark], **arguments: Unpack[EnvArguments]
) -> RobotEnv:
    """Make an environment.

    Args:
        benchmark: Name of the benchmark, such as `Lift`, ignoring case; or its file, or
            a class of your own (examples/08_own_environment.py).
        arguments: See `wbc_suite.envs.config.EnvConfig`: `robots`,
            `controller_configs`, `control_freq`, `horizon`, `reward_shaping`, ...;
            and for errors see `RobotEnv`.
    """
    return RobotEnv(benchmark, **arguments)
