"""What is done is written down, so that the rest can go on tomorrow."""

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from wbc_suite.errors import DatasetError
from wbc_suite.executors.executor import Executor
from wbc_suite.executors.item import Item, Json, Outcome, Work

__all__ = ["Ledger", "work_off"]

MAX_BYTES = 64 << 20
"""A result file beyond this is not read."""


class Ledger:
    """One JSON file per finished item, in the folder `results`.

    A file is complete or not there: it is written beside its place and moved.

    Args:
        folder: Of the whole piece of work; made when it is missing.

    Raises:
        DatasetError: If the folder cannot be written to.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._results = folder / "results"
        try:
            self._results.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise DatasetError(f"'{folder}' cannot be written to: {error}.") from error

    def write(self, item: Item, outcome: Outcome) -> None:
        """Write down what came of an item, in place of what came of it before."""
        path = self._path(item)
        text = json.dumps(
            {
                "item": item.name,
                "payload": item.payload,
                "error": outcome.error,
                "result": outcome.result,
            },
            indent=1,
            sort_keys=True,
        )
        beside = path.with_suffix(f".{os.getpid()}.tmp")
        try:
            beside.write_text(text + "\n", encoding="utf-8")
            beside.replace(path)
        except OSError as error:
            raise DatasetError(f"'{path}' cannot be written: {error}.") from error

    def result(self, item: Item) -> dict[str, Json] | None:
        """Return an item's result; None when it is not done, or was told otherwise."""
        path = self._path(item)
        try:
            if path.stat().st_size > MAX_BYTES:
                return None
            record = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return None
        if not isinstance(record, dict) or record.get("error") is not None:
            return None
        same = record.get("payload") == json.loads(json.dumps(item.payload))
        result = record.get("result")
        return result if same and isinstance(result, dict) else None

    def _path(self, item: Item) -> Path:
        return self._results / f"{item.name}.json"


def work_off(
    work: Work,
    items: Sequence[Item],
    *,
    folder: Path,
    executor: Executor,
    tell: Callable[[Item, Outcome], None] | None = None,
) -> list[Outcome]:
    """Do the items that are not done yet, and write each down as it ends.

    It can be stopped at any time and called again: what is done is not done twice, what
    failed is.

    Args:
        work: Function of an importable module; see `Work`.
        items: All of them, done or not; names must differ.
        folder: Where results, and what the work writes, lie.
        executor: Who does them.
        tell: Called with every item that is known to have ended, at once for those that
            had ended before.

    Returns:
        All outcomes, in the order of the items.
    """
    by_name = {item.name: item for item in items}
    if len(by_name) != len(items):
        raise DatasetError("Two items have the same name: their results would be one.")
    ledger = Ledger(folder)
    outcomes: dict[str, Outcome] = {}

    def note(outcome: Outcome) -> None:
        outcomes[outcome.name] = outcome
        if tell is not None:
            tell(by_name[outcome.name], outcome)

    for item in items:
        if (result := ledger.result(item)) is not None:
            note(Outcome(name=item.name, result=result))
    missing = [item for item in items if item.name not in outcomes]
    for outcome in executor.run(work, missing, folder):
        ledger.write(by_name[outcome.name], outcome)
        note(outcome)
    return [outcomes[item.name] for item in items]
