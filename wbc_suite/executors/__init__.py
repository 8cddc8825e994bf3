"""Work items, run in this process, in worker processes, on Ray or on Slurm."""

from wbc_suite.errors import UnknownNameError
from wbc_suite.executors.clusters import RayCluster, Slurm
from wbc_suite.executors.executor import Executor, Outcome, WorkItem
from wbc_suite.executors.local import Processes, Serial
from wbc_suite.executors.results import ResultFolder, run_items

__all__ = [
    "EXECUTORS",
    "Executor",
    "Outcome",
    "Processes",
    "ResultFolder",
    "Serial",
    "WorkItem",
    "make_executor",
    "run_items",
]

EXECUTORS = ("process", "serial", "ray", "slurm")


def make_executor(name: str, *, workers: int | None = None) -> Executor:
    """Make one of `EXECUTORS` for so many items at once; None for one per processor.

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
            return RayCluster(workers=workers)
        case "slurm":
            return Slurm()
    raise UnknownNameError("executor", name, EXECUTORS)
