"""Recordings in the layouts of others."""

from collections.abc import Callable
from pathlib import Path

from wbc_suite.errors import DatasetError, UnknownNameError
from wbc_suite.executors import Executor
from wbc_suite.recording.converting.layouts import LAYOUTS
from wbc_suite.recording.converting.shared import convert_shared
from wbc_suite.recording.dataset import Dataset

__all__ = ["LAYOUTS", "convert"]


def convert(
    source: str | Path,
    out: str | Path,
    layout: str,
    tell: Callable[[int], None] = lambda _: None,
    *,
    executor: Executor | None = None,
    workers: int = 1,
) -> Path:
    """Write a recording in another layout; what was written is returned.

    With an executor, pieces wait in `OUT.work` until all are done: stopped, it goes on
    when called again. A layout that is one file is one piece.

    Args:
        source: The recording.
        out: File, or folder, to write.
        layout: One of `LAYOUTS`.
        tell: Called with the number of episodes that were written since the last call.
        executor: Who does the work; this process, in one go, when left out.
        workers: How many it has: episodes are shared out among them.

    Raises:
        UnknownNameError: If there is no such layout.
        DatasetError: If the recording cannot be read, a package is missing, or the
            path cannot be written.
    """
    source, out = Path(source), Path(out)
    if layout not in LAYOUTS:
        raise UnknownNameError("layout", layout, LAYOUTS)
    with Dataset(source) as dataset:
        if not len(dataset):
            raise DatasetError(f"'{source}' has no episodes.")
        if executor is None:
            return LAYOUTS[layout].write(dataset, out, lambda _: tell(1))
        convert_shared(
            dataset, out, layout, executor=executor, workers=workers, tell=tell
        )
    return out
