"""Texts of a recording: damage that would keep HDF5 reading for ever is refused."""

import struct

import h5py
import pytest

from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, heaps

FREE = 0
"""Number of what is free in a heap."""


def texts(content):
    """Yield where each text of each heap tells its size, and its number."""
    heap = content.find(b"GCOL")
    while heap >= 0:
        (size,) = struct.unpack_from("<Q", content, heap + 8)
        at = heap + 16
        while at + 16 <= heap + size:
            number, _, length = struct.unpack_from("<HH4xQ", content, at)
            yield at + 8, number
            at += 16 + -(-length // 8) * 8 if number else length
        heap = content.find(b"GCOL", heap + 1)


def test_recordings_pass(small_recording):
    heaps.check_heaps(small_recording)
    assert len(list(texts(small_recording.read_bytes()))) > 5


@pytest.mark.parametrize(
    ("size", "free"), [(0, True), (1, True), (2**64 - 16, False), (2**63, False)]
)
def test_sizes_that_lead_nowhere_are_refused(small_recording, size, free):
    content = bytearray(small_recording.read_bytes())
    place = next(at for at, n in texts(content) if (n == FREE) == free)
    struct.pack_into("<Q", content, place, size)
    small_recording.write_bytes(content)
    with pytest.raises(DatasetError, match="where its texts are"):
        Dataset(small_recording)


def test_heaps_are_found_wherever_they_begin(small_recording, monkeypatch):
    content = small_recording.read_bytes()
    places, at = [], content.find(heaps.SIGNATURE)
    while at >= 0:
        places.append(at)
        at = content.find(heaps.SIGNATURE, at + 1)
    for block in (1, 3, 4, 5, 7, 64):
        monkeypatch.setattr(heaps, "BLOCK", block)
        with small_recording.open("rb") as file:
            assert list(heaps._heaps(file)) == places


def test_unusual_addresses_are_refused(tmp_path):
    path = tmp_path / "narrow.hdf5"
    plan = h5py.h5p.create(h5py.h5p.FILE_CREATE)
    plan.set_sizes(4, 4)
    h5py.h5f.create(bytes(path), fcpl=plan).close()
    with pytest.raises(DatasetError, match="unusual length"):
        Dataset(path)


def test_what_stands_before_a_file_is_passed_over(small_recording, tmp_path):
    path = tmp_path / "later.hdf5"
    with (
        h5py.File(small_recording) as file,
        h5py.File(path, "w", userblock_size=1024) as later,
    ):
        file.copy("data", later)
        later["data"].attrs.update(file["data"].attrs)
    heaps.check_heaps(path)
