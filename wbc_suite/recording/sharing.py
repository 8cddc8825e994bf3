"""Work on a recording, shared out among workers; stopped, it goes on another time."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from wbc_suite.errors import DatasetError
from wbc_suite.executors import Executor, Item, Serial, work_off
from wbc_suite.executors.item import Json, Work
from wbc_suite.recording.files import check_folder

__all__ = ["share_out", "work_folder"]


def work_folder(out: Path) -> Path:
    """Return where pieces wait until all are done; `OUT.work`."""
    return out.with_name(out.name + ".work")


def share_out(
    work: Work,
    payloads: Sequence[Mapping[str, Json]],
    *,
    source: Path,
    out: Path,
    executor: Executor | None,
    tell: Callable[[Item], None],
) -> list[tuple[Item, Mapping[str, Json]]]:
    """Do the pieces that are not done yet; return all, in order, with their results.

    Args:
        work: See `Work`; its payload says the `source` too.
        payloads: What each piece of work is told.
        source: The recording; another one is other work.
        out: What is being written.
        executor: Who does the work; this process when left out.
        tell: Called with every piece that is done.

    Raises:
        DatasetError: If a piece fails; the others are kept.
    """
    folder = work_folder(out)
    check_folder(folder)
    stat = source.stat() if source.exists() else None
    common: dict[str, Json] = {
        "source": str(source.resolve()),
        "written": None if stat is None else [stat.st_size, stat.st_mtime_ns],
    }
    told = [{**common, **payload} for payload in payloads]
    items = [
        Item(name=f"{k:06d}-{_digest(payload)}", payload=payload)
        for k, payload in enumerate(told)
    ]
    outcomes = work_off(
        work,
        items,
        folder=folder,
        executor=executor or Serial(),
        tell=lambda item, outcome: tell(item) if outcome.error is None else None,
    )
    failed = [outcome.error for outcome in outcomes if outcome.error is not None]
    if failed:
        words = failed[0].removeprefix("DatasetError: ")
        raise DatasetError(f"{len(failed)} of {len(items)} pieces failed: {words}")
    results = (outcome.result for outcome in outcomes)
    return list(zip(items, results, strict=True))


def _digest(payload: Mapping[str, Json]) -> str:
    return hashlib.sha256(json.dumps(payload, sort_keys=True).encode()).hexdigest()[:12]
