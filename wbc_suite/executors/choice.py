"""Executors by name, as command lines ask for them."""

from wbc_suite.errors import UnknownNameError
from wbc_suite.executors.executor import Executor
from wbc_suite.executors.processes import Processes
from wbc_suite.executors.serial import Serial

__all__ = ["EXECUTORS", "make_executor"]

EXECUTORS = ("process", "serial", "ray", "slurm")


def make_executor(name: str, *, workers: int | None = None) -> Executor:
    """Make the executor of a name.

    Args:
        name: One of `EXECUTORS`.
        workers: How many items at once; None for as many as there are processors.

    Raises:
        UnknownNameError: If there is no such executor.
        ConfigError: If its package is not installed.
    """
    match name:
        case "serial":
            return Serial()
        case "process":
            return Processes(workers)
        case "ray":
            from wbc_suite.executors.ray_cluster import RayCluster

            return RayCluster(workers=workers)
        case "slurm":
            from wbc_suite.executors.slurm import Slurm

            return Slurm()
        case _:
            raise UnknownNameError("executor", name, EXECUTORS)
