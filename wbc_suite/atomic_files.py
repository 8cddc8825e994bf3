"""Files that are written completely or not at all: written aside, synced, renamed."""

import glob
import os
import platform
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from wbc_suite.errors import DatasetError, WbcError

RESERVE = 1 << 20  # bytes that must be left on the disk after a file is written


def check_folder(folder: Path, needed: int = 0) -> None:
    """Make a folder if missing; raise DatasetError if `needed` bytes do not fit."""
    try:
        new = [path for path in (folder, *folder.parents) if not path.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        for path in new:  # a power failure takes away what its folder does not name
            _sync(path.parent)
        with tempfile.TemporaryFile(dir=folder):
            pass
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

    The file is complete or absent, also after a power failure. The temporary file has
    the suffix of the path.

    Raises:
        DatasetError: If it cannot be written; an old file stays as it was.
    """
    temporary = temporary_path(path)
    try:
        try:
            write(temporary)
            _sync(temporary)
            temporary.replace(path)
            _sync(path.parent)
        finally:
            temporary.unlink(missing_ok=True)
    except WbcError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a suffix unknown to Pillow
        raise DatasetError(
            f"'{path}' cannot be written: {getattr(error, 'strerror', None) or error}. "
            "Any existing file is unchanged."
        ) from error


def temporary_path(path: Path) -> Path:
    """Return where this process writes `path`; delete what killed ones left of it."""
    start = f".{path.name}.{platform.node()}-"
    for left in path.parent.glob(f"{glob.escape(start)}*.tmp*"):
        number = left.name.removeprefix(start).partition(".")[0]
        if number.isdigit() and not _runs(int(number)):
            _delete(left)
    return path.with_name(f"{start}{os.getpid()}.tmp{path.suffix}")


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # another user's
        return True
    return True


def _delete(path: Path) -> None:
    with suppress(OSError):
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def delete_temporaries(folder: Path) -> None:
    """Delete what killed processes left of files that they were writing."""
    for temporary in folder.rglob(".*.tmp*"):
        _delete(temporary)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
