"""Files that are written completely or not at all: written aside, synced, renamed."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

from wbc_suite.errors import DatasetError

RESERVE = 1 << 20  # bytes that must be left on the disk after a file is written


def check_folder(folder: Path, needed: int = 0) -> None:
    """Make a folder if missing; raise DatasetError if `needed` bytes do not fit."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".wbc-suite-{os.getpid()}"
        probe.touch()
        probe.unlink()
        free = shutil.disk_usage(folder).free
    except OSError as error:
        raise DatasetError(
            f"'{folder}' cannot be written to: {error.strerror}. Choose another folder."
        ) from error
    if free < needed + RESERVE:
        raise DatasetError(
            f"'{folder}' has {free / 1e6:.1f} MB left and "
            f"{(needed + RESERVE) / 1e6:.1f} MB are needed. Free some space, or choose "
            "another folder; nothing finished is lost."
        )


def new_folder(folder: Path, content: str) -> None:
    """Make a folder for `content`; raise DatasetError if it exists and is not empty."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise DatasetError(f"'{folder}' is not empty; {content} needs a new folder.")
    check_folder(folder)


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file; see `replace_file`."""
    replace_file(path, lambda temporary: temporary.write_bytes(content))


def replace_file(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` write a temporary file, sync it, and rename it to `path`.

    The file is complete or absent, also after a power failure.

    Raises:
        DatasetError: If it cannot be written; an old file stays as it was.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        try:
            write(temporary)
            _sync(temporary)
            temporary.replace(path)
            _sync(path.parent)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise DatasetError(
            f"'{path}' cannot be written: {error.strerror or error}. What was there "
            "before is as it was."
        ) from error


def delete_temporaries(folder: Path) -> None:
    """Delete what killed processes left of files that they were writing."""
    for temporary in folder.rglob(".*.tmp"):
        temporary.unlink()


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
