"""The heaps in which an HDF5 file keeps its texts, looked at before HDF5 reads them.

HDF5 steps from text to text by the sizes that they tell. A damaged size, nothing or so
large that the sum wraps, keeps it in one place for ever, with Python's lock held.

Source: HDF5 File Format Specification 3.0, sections II and III.E.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from wbc_suite.errors import DatasetError

__all__ = ["check_heaps"]

SIGNATURE = b"GCOL\x01"
"""Begins every heap, with its version."""
HEAP = struct.Struct("<5s3xQ")
TEXT = struct.Struct("<HH4xQ")
SMALLEST = 4096
"""Bytes; smaller heaps HDF5 refuses itself."""
BLOCK = 1 << 20
"""Bytes that are searched at a time."""
SUPERBLOCK = b"\x89HDF\r\n\x1a\n"
WIDE = 8
"""Bytes of an address and of a length."""


def check_heaps(path: Path) -> None:
    """Refuse a file with a heap in which HDF5 would not come to an end.

    Raises:
        DatasetError: If there is one.
        OSError: If the file cannot be read.
    """
    with path.open("rb") as file:
        if _widths(file) != (WIDE, WIDE):
            raise DatasetError(f"'{path}' has addresses of an unusual length.")
        end = file.seek(0, 2)
        for at in _heaps(file):
            file.seek(at)
            header = file.read(HEAP.size)
            size = HEAP.unpack(header)[1] if len(header) == HEAP.size else 0
            if SMALLEST <= size <= end - at and not _ends(file.read(size - HEAP.size)):
                raise DatasetError(f"'{path}' is damaged where its texts are.")


def _widths(file: BinaryIO) -> tuple[int, ...]:
    """Return how many bytes addresses and lengths have."""
    at, end = 0, file.seek(0, 2)
    while at < end:
        file.seek(at)
        found = file.read(15)
        if found.startswith(SUPERBLOCK) and len(found) == 15:
            first = 13 if found[8] < 2 else 9
            return tuple(found[first : first + 2])
        at = 2 * at or 512
    return ()


def _heaps(file: BinaryIO) -> Iterator[int]:
    """Yield where heaps begin; the file may be moved meanwhile."""
    begin, rest = 0, b""
    while True:
        file.seek(begin + len(rest))
        block = file.read(BLOCK)
        if not block:
            return
        searched = rest + block
        at = searched.find(SIGNATURE)
        while at >= 0:
            yield begin + at
            at = searched.find(SIGNATURE, at + 1)
        kept = min(len(SIGNATURE) - 1, len(searched))
        begin, rest = begin + len(searched) - kept, searched[-kept:]


def _ends(heap: bytes) -> bool:
    """Return whether texts follow each other up to the end."""
    at = 0
    while len(heap) - at >= TEXT.size:
        number, _, size = TEXT.unpack_from(heap, at)
        # Number 0 is what is free, and counts its own header.
        step = TEXT.size + -(-size // 8) * 8 if number else size
        if not TEXT.size <= step <= len(heap) - at:
            return False
        at += step
    return True
