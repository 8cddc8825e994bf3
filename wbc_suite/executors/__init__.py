"""Work cut into items, done by whatever is there: this process, many, or a cluster."""

from wbc_suite.executors.choice import EXECUTORS, make_executor
from wbc_suite.executors.executor import Executor
from wbc_suite.executors.item import Item, Outcome
from wbc_suite.executors.ledger import Ledger, work_off
from wbc_suite.executors.processes import Processes
from wbc_suite.executors.serial import Serial

__all__ = [
    "EXECUTORS",
    "Executor",
    "Item",
    "Ledger",
    "Outcome",
    "Processes",
    "Serial",
    "make_executor",
    "work_off",
]
