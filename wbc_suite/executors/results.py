"""Results of work items in a folder, so that stopped work continues later."""

import json
from collections.abc import Callable, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

from wbc_suite.atomic_files import check_folder, write_bytes
from wbc_suite.config_files import parse_json
from wbc_suite.errors import ConfigError, DatasetError
from wbc_suite.executors.executor import Executor, Outcome, Work, WorkItem
from wbc_suite.files import read_text

MAX_BYTES = 64 << 20  # larger result files are not read


class ResultFolder:
    """One JSON file per finished item, in the subfolder `results` of a folder.

    A file is complete or absent; one with a wrong checksum counts as absent. The folder
    is made if missing; DatasetError is raised if it cannot be written to.
    """

    def __init__(self, folder: Path) -> None:
        self._results = folder / "results"
        check_folder(self._results)

    def write(self, item: WorkItem, outcome: Outcome) -> None:
        """Write an item's outcome, in place of an earlier one."""
        record = {"item": item.name, "payload": item.payload}
        record |= {"error": outcome.error, "result": outcome.result}
        record["sha256"] = _checksum(outcome.result)
        text = json.dumps(record, indent=1, sort_keys=True)
        write_bytes(self._path(item), f"{text}\n".encode())

    def read(self, item: WorkItem) -> dict[str, Any] | None:
        """Return an item's result; None if it has none, or had another payload."""
        path = self._path(item)
        try:
            record = parse_json(read_text(path, most=MAX_BYTES), source=str(path))
        except ConfigError:
            return None
        if record.get("error") is not None:
            return None
        same = record.get("payload") == json.loads(json.dumps(item.payload))
        result = record.get("result")
        whole = same and record.get("sha256") == _checksum(result)
        return result if whole and isinstance(result, dict) else None

    def _path(self, item: WorkItem) -> Path:
        return self._results / f"{item.name}.json"


def _checksum(result: Any) -> str:
    plain = json.loads(json.dumps(result))
    return sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def run_items(
    work: Work,
    items: Sequence[WorkItem],
    *,
    folder: Path,
    executor: Executor,
    on_outcome: Callable[[WorkItem, Outcome], None] | None = None,
) -> list[Outcome]:
    """Run items that have no result yet; return all outcomes, in order of the items.

    Each outcome is written as it ends. The call can be stopped and repeated: finished
    items do not run again, failed ones do. `on_outcome` is called with every item and
    its outcome; at once for items that finished in an earlier call.

    Raises:
        DatasetError: If two items have one name, or the folder cannot be written to.
    """
    by_name = {item.name: item for item in items}
    if len(by_name) != len(items):
        raise DatasetError("Two work items have the same name.")
    results = ResultFolder(folder)
    outcomes: dict[str, Outcome] = {}

    def add(outcome: Outcome) -> None:
        outcomes[outcome.name] = outcome
        if on_outcome is not None:
            on_outcome(by_name[outcome.name], outcome)

    for item in items:
        if (result := results.read(item)) is not None:
            add(Outcome(name=item.name, result=result))
    missing = [item for item in items if item.name not in outcomes]
    for outcome in executor.run(work, missing, folder):
        results.write(by_name[outcome.name], outcome)
        add(outcome)
    return [outcomes[item.name] for item in items]
