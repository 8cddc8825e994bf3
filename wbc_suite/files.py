"""Open files that a user names: regular ones of bounded size.

A name may be a link to a device that never ends, or a pipe that never begins. Files are
read here, or checked here before a library opens them.
"""

import os
import stat
from pathlib import Path
from typing import BinaryIO

from wbc_suite.errors import ConfigError, WbcError

MAX_TEXT = 4_000_000
"""Largest TOML or JSON file that is read, bytes; the catalogue's largest has 60 kB."""


def open_file(
    path: Path, *, most: int | None = None, error: type[WbcError] = ConfigError
) -> BinaryIO:
    """Open a regular file for reading, of at most so many bytes.

    Raises:
        WbcError: An `error`, if it is missing, too large, or a folder, device or pipe.
    """
    try:  # without O_NONBLOCK, a pipe that nobody writes to is waited for
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    except (OSError, ValueError) as cause:  # ValueError: a null character in the name
        reason = getattr(cause, "strerror", None) or cause
        raise error(f"{path}: cannot be read ({reason}).") from cause
    found, fault = os.fstat(handle), ""
    if not stat.S_ISREG(found.st_mode):
        fault = "cannot be read (it is a folder, a device or a pipe)."
    elif most is not None and found.st_size > most:
        fault = _too_large(found.st_size, most)
    if fault:
        os.close(handle)
        raise error(f"{path}: {fault}")
    return os.fdopen(handle, "rb")


def check_file(
    path: Path, *, most: int | None = None, error: type[WbcError] = ConfigError
) -> os.stat_result:
    """Return the status of a file that a library will open; errors as `open_file`."""
    with open_file(path, most=most, error=error) as stream:
        return os.fstat(stream.fileno())


def read_bytes(path: Path, *, most: int, error: type[WbcError] = ConfigError) -> bytes:
    """Read a file; errors as `open_file`."""
    with open_file(path, most=most, error=error) as stream:
        content = stream.read(most + 1)  # those of /proc have a size of 0
    if len(content) > most:
        raise error(f"{path}: {_too_large(len(content), most)}")
    return content


def read_text(
    path: Path, *, most: int = MAX_TEXT, error: type[WbcError] = ConfigError
) -> str:
    """Read a text file; errors as `open_file`, and if it is not UTF-8."""
    try:
        return read_bytes(path, most=most, error=error).decode("utf-8")
    except UnicodeDecodeError as cause:
        raise error(f"{path}: is not text in UTF-8: {cause}.") from cause


def _too_large(size: int, most: int) -> str:
    return (
        f"the file has {size} bytes; at most {most} are read. Is this the right file?"
    )
