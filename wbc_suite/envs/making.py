"""`make`: an environment by the name of its benchmark."""

from typing import Any

from wbc_suite.envs.env import RobotEnv

__all__ = ["make"]


def make(benchmark: str, **arguments: Any) -> RobotEnv:
    """Make an environment.

    Args:
        benchmark: Name of the benchmark, such as `Lift`, without regard to case.
        arguments: See `wbc_suite.envs.config.EnvConfig`: `robots`,
            `controller_configs`, `control_freq`, `horizon`, `reward_shaping`, ...

    Raises:
        UnknownNameError: If the benchmark, a robot or a controller is unknown.
        ConfigError: If an argument is wrong.
    """
    return RobotEnv(benchmark, **arguments)
