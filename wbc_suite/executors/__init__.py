"""Work items, run in this process, in worker processes, on Ray or on Slurm."""

from wbc_suite.executors.executor import (
    EXECUTORS,
    Executor,
    Outcome,
    WorkItem,
    make_executor,
)
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
