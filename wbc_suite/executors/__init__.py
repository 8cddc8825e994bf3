"""Work items, run in this process, in worker processes, on Ray or on Slurm."""

from collections.abc import Callable

from wbc_suite.executors.clusters import RayCluster, Slurm
from wbc_suite.executors.executor import Executor, Outcome, WorkItem
from wbc_suite.executors.local import Processes, Serial
from wbc_suite.executors.results import ResultFolder, run_items
from wbc_suite.registry import Registry

__all__ = [
    "EXECUTORS",
    "Executor",
    "Outcome",
    "Processes",
    "ResultFolder",
    "Serial",
    "WorkItem",
    "make_executor",
    "register_executor",
    "run_items",
]

EXECUTORS: Registry[Callable[..., Executor]] = Registry("executor")
"""Classes of executors, or functions that make them, by name: for `--executor`.

They are called with `workers`, the number of items at once; None for one per processor.
"""

register_executor = EXECUTORS.register
register_executor("process", Processes)
register_executor("serial", lambda workers: Serial())
register_executor("ray", RayCluster)
register_executor("slurm", lambda workers: Slurm())


def make_executor(name: str, *, workers: int | None = None) -> Executor:
    """Make one of `EXECUTORS`, or `module:Class`, for so many items at once.

    Raises:
        UnknownNameError: If there is no such executor.
        ConfigError: If its package or module cannot be imported.
    """
    return EXECUTORS.find(name)(workers=workers)
