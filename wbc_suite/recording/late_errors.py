"""A file whose errors wait until the one who writes has finished."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

__all__ = ["late_errors"]


@contextmanager
def late_errors(path: Path) -> Iterator[Any]:
    """Open a new file for HDF5, which breaks when a disk fills up under it.

    After the first error nothing more is written, and all looks well; the error is
    raised at the end, and the file is not to be used.

    Raises:
        OSError: If something could not be written.
    """
    file = _File(os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o666))
    try:
        yield file
    finally:
        os.close(file.handle)
        if file.error is not None:
            raise file.error


class _File:
    """What HDF5's driver for Python's files asks for."""

    def __init__(self, handle: int) -> None:
        self.handle = handle
        self.error: OSError | None = None
        self._at = self._end = 0

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        starts = {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._end}
        self._at = starts[whence] + offset
        return self._at

    def tell(self) -> int:
        return self._at

    def read(self, size: int) -> bytes:
        found = os.pread(self.handle, size, self._at).ljust(size, b"\0")
        self._at += size
        return found

    def write(self, content: Any) -> int:
        rest = memoryview(content).cast("B")
        size = len(rest)
        try:
            while rest and self.error is None:  # a full disk takes a part
                written = os.pwrite(self.handle, rest, self._at)
                rest, self._at = rest[written:], self._at + written
        except OSError as error:
            self.error = error
        self._at += len(rest)
        self._end = max(self._end, self._at)
        return size

    def truncate(self, size: int | None = None) -> int:
        self._end = self._at if size is None else size
        try:
            if self.error is None:
                os.ftruncate(self.handle, self._end)
        except OSError as error:
            self.error = error
        return self._end

    def flush(self) -> None:
        """Do nothing: who puts the file in its place syncs it."""
