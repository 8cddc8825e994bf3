"""Items one after the other, in this process: for debugging."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from wbc_suite.executors.item import Item, Outcome, Work, attempt

__all__ = ["Serial"]


class Serial:
    """Does items here, in their order."""

    def run(self, work: Work, items: Sequence[Item], folder: Path) -> Iterator[Outcome]:
        """Do all items; see `Executor`."""
        for item in items:
            yield attempt(work, item, folder)
