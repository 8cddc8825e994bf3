"""Files that are whole or not there: written aside, synced, then renamed."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

from wbc_suite.errors import DatasetError

__all__ = ["check_folder", "new_folder", "replace_file", "write_bytes"]

SPARE = 1 << 20
"""Bytes that must be left on the disk after a file is written."""


def check_folder(folder: Path, needed: int = 0) -> None:
    """Say early that a folder cannot take a file.

    Raises:
        DatasetError: If it is missing and cannot be made, is read-only, or has less
            room than is needed.
    """
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
    if free < needed + SPARE:
        raise DatasetError(
            f"'{folder}' has {free / 1e6:.1f} MB left and "
            f"{(needed + SPARE) / 1e6:.1f} MB are needed. Free some space, or choose "
            "another folder; nothing finished is lost."
        )


def new_folder(folder: Path, what: str, needed: int = 0) -> None:
    """Make an empty folder.

    Args:
        folder: Where.
        what: What it will hold, in words.
        needed: Bytes that it will take, if known.

    Raises:
        DatasetError: If something is in it already, or see `check_folder`.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise DatasetError(f"'{folder}' is not empty; {what} needs a new folder.")
    check_folder(folder, needed)


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file that is either whole, also after a power cut, or not there.

    Raises:
        DatasetError: If it cannot be written; then an old file is as it was.
    """

    def write(aside: Path) -> None:
        aside.write_bytes(content)

    replace_file(path, write)


def replace_file(path: Path, write: Callable[[Path], None]) -> None:
    """Let `write` write a file aside, and put it in place of the old one at once.

    Raises:
        DatasetError: If it cannot be written; then an old file is as it was.
    """
    aside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        try:
            write(aside)
            _sync(aside)
            aside.replace(path)
            _sync(path.parent)
        finally:
            aside.unlink(missing_ok=True)
    except OSError as error:
        raise DatasetError(
            f"'{path}' cannot be written: {error.strerror or error}. What was there "
            "before is as it was."
        ) from error


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
