"""`make`: an environment by the name of its benchmark."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from wbc_suite.benchmark import Benchmark
from wbc_suite.envs.env import RobotEnv

__all__ = ["make"]


def make(benchmark: str | Path | Callable[[], Benchmark], **arguments: Any) -> RobotEnv:
    """Make an environment.

    Args:
        benchmark: Name of the benchmark, such as `Lift`, without regard to case; or a
            file of it, or a class of your own (examples/08_own_environment.py).
        arguments: See `wbc_suite.envs.config.EnvConfig`: `robots`,
            `controller_configs`, `control_freq`, `horizon`, `reward_shaping`, ...

    Raises:
        UnknownNameError: If the benchmark, a robot or a controller is unknown.
        ConfigError: If an argument is wrong.
    """
    return RobotEnv(benchmark, **arguments)
