"""The seam between work and the machines that do it."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

from wbc_suite.executors.item import Item, Outcome, Work

__all__ = ["Executor"]


class Executor(Protocol):
    """Does items in any order, anywhere, and hands back outcomes as they come."""

    def run(self, work: Work, items: Sequence[Item], folder: Path) -> Iterator[Outcome]:
        """Do all items.

        Args:
            work: Function of an importable module.
            items: What is to be done.
            folder: Where the work may write; every worker must reach it.

        Yields:
            One outcome per item. A worker that dies takes no other item with it: its
            item is done again, and is an error when it kills its worker every time.
        """
        ...
