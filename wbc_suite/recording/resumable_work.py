"""Work on a recording that is split into pieces and continues after a stop."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from wbc_suite.atomic_files import check_folder
from wbc_suite.errors import DatasetError
from wbc_suite.executors import Executor, Outcome, Serial, WorkItem, run_items
from wbc_suite.executors.executor import Work


def work_folder(out: Path) -> Path:
    """Return the folder of finished pieces until all are finished; `OUT.work`."""
    return out.with_name(out.name + ".work")


@contextmanager
def reading_pieces(out: Path) -> Iterator[None]:
    """Say what to do if finished pieces are damaged or missing, by a DatasetError."""
    try:
        yield
    except (DatasetError, OSError) as error:
        if str(folder := work_folder(out)) not in str(error):
            raise
        raise DatasetError(
            f"Finished pieces in '{folder}' are damaged. Delete this folder and run "
            "the same command to begin again."
        ) from error


def run_pieces(
    work: Work,
    payloads: Sequence[Mapping[str, Any]],
    *,
    source: Path,
    out: Path,
    executor: Executor | None,
    on_piece: Callable[[WorkItem, Mapping[str, Any]], None],
) -> list[tuple[WorkItem, Mapping[str, Any]]]:
    """Run the pieces that are not finished; return all, in order, with their results.

    Results of another source, or of one that changed, are not used. The source is in
    every payload. `on_piece` is called with every finished piece and its result.

    Raises:
        DatasetError: If a piece fails; results of the others are kept.
    """
    folder = work_folder(out)
    check_folder(folder)
    stat = source.stat() if source.exists() else None
    written = None if stat is None else [stat.st_size, stat.st_mtime_ns]
    common = {"source": str(source.resolve()), "written": written}
    items = [
        WorkItem.with_digest(f"{k:06d}", {**common, **payload})
        for k, payload in enumerate(payloads)
    ]

    def report(item: WorkItem, outcome: Outcome) -> None:
        if outcome.error is None:
            on_piece(item, outcome.result)

    outcomes = run_items(
        work, items, folder=folder, executor=executor or Serial(), on_outcome=report
    )
    failed = [outcome.error for outcome in outcomes if outcome.error is not None]
    if failed:
        reason = failed[0].removeprefix("DatasetError: ")
        raise DatasetError(f"{len(failed)} of {len(items)} pieces failed: {reason}")
    results = (outcome.result for outcome in outcomes)
    return list(zip(items, results, strict=True))
