"""Disks that are full or read-only for real, or files that may not grow further."""

import resource
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from random_episodes import HEADER, make_episode

from wbc_suite import atomic_files
from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, Store, episode_store, hdf5_writer
from wbc_suite.recording.hdf5_writer import open_late_errors
from wbc_suite.recording.step_buffer import BLOCK_BYTES, RowBuffer

SIZE = 24 << 20  # bytes; a recording begins with 20 MB free
BIG = 3 << 20


class Disk:
    """A small disk of its own, which can be filled and made read-only."""

    def __init__(self, folder):
        self.folder, self.filler = folder, folder / "filler"

    def fill(self, leave=0):
        """Write until only so many bytes are left, or none."""
        with self.filler.open("wb", buffering=0) as file:
            with pytest.raises(OSError, match="No space left"):
                write_forever(file)
            file.truncate(max(file.tell() - leave, 0))

    def read_only(self):
        subprocess.run(["mount", "-o", "remount,ro", self.folder], check=True)


@pytest.fixture
def disk(tmp_path):
    folder = tmp_path / "disk"
    folder.mkdir()
    try:
        subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "tmpfs", folder],
            check=True,
            capture_output=True,
        )
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("This user may not mount a disk of its own.")
    yield Disk(folder)
    subprocess.run(["umount", folder], check=True)


@pytest.fixture
def short_files():
    """Let no file grow beyond 1 MB, which needs no rights: as quotas do."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def write_forever(file):
    while True:
        file.write(bytes(1 << 16))


def append_rows(rows, count):
    """Append so many bytes of rows."""
    rows.begin(np.dtype([("states", "f8", (512,))]))
    for _ in range(count // 4096):
        rows.advance()


def uids(path):
    with Dataset(path) as dataset:
        return [episode.facts["uid"] for episode in dataset]


def left_aside(folder):
    return [path.name for path in folder.rglob(".*")]


def test_recording_onto_a_full_disk_says_so_and_loses_nothing(disk):
    path = disk.folder / "a.hdf5"
    recording = Store(path, HEADER)
    recording.add(make_episode(0))
    disk.fill(leave=BIG // 2)
    with pytest.raises(DatasetError, match=r"MB left .*nothing finished is lost"):
        recording.add(make_episode(1, length=BIG // 88))
    recording.add(make_episode(1))
    disk.fill()
    with pytest.raises(DatasetError, match="Free some space"):
        recording.close()
    assert uids(path) == ["0", "1"]
    with pytest.raises(DatasetError, match=r"cannot be written|MB left"):
        Store(path, HEADER)
    disk.filler.unlink()
    with Store(path, HEADER) as again:
        again.add(make_episode(2))
    assert uids(path) == ["0", "1", "2"]
    assert left_aside(disk.folder) == []


@pytest.mark.parametrize("room", [0, 1000, 1 << 20])
def test_disk_that_fills_up_while_writing_leaves_the_old_file(disk, monkeypatch, room):
    path = disk.folder / "a.hdf5"
    with Store(path, HEADER) as recording:
        recording.add(make_episode(0))
    for place in (
        atomic_files,
        episode_store,
        hdf5_writer,
    ):  # it looked free a moment ago
        monkeypatch.setattr(place, "check_folder", lambda folder, needed=0: None)
    disk.fill(leave=room)
    big = replace(make_episode(1, length=BIG // 88), name="demo_0")
    with pytest.raises(DatasetError, match="file is unchanged"):
        atomic_files.write_bytes(path, bytes(BIG))
    with pytest.raises(DatasetError, match="file is unchanged"):
        hdf5_writer.write_dataset(path, [big], HEADER)
    disk.filler.unlink()
    assert uids(path) == ["0"]
    assert left_aside(disk.folder) == []


def test_rows_of_an_episode_that_no_longer_fit_are_said_to_be_lost(disk):
    rows = RowBuffer(disk.folder)
    disk.fill(leave=BLOCK_BYTES + BLOCK_BYTES // 2)  # the second block goes halfway
    with pytest.raises(DatasetError, match=r"No space left.*finished ones are safe"):
        append_rows(rows, 3 * BLOCK_BYTES)
    rows.close()


def test_read_only_disk_is_said_and_what_is_on_it_is_read(disk):
    path = disk.folder / "a.hdf5"
    with Store(path, HEADER) as recording:
        recording.add(make_episode(0))
    recording = Store(path, HEADER)
    recording.add(make_episode(1))
    recording._lock.close()
    disk.read_only()
    with pytest.raises(DatasetError, match=r"Read-only file system.*another folder"):
        recording.add(make_episode(2))
    with pytest.raises(DatasetError, match="Read-only file system"):
        Store(path, HEADER)
    with pytest.raises(DatasetError, match="Read-only file system"):
        Store(disk.folder / "new" / "b.hdf5", HEADER)
    assert uids(path) == ["0", "1"]


def test_files_that_may_not_grow_further_are_said_and_old_ones_stay(
    tmp_path, short_files
):
    path = tmp_path / "a.hdf5"
    with Store(path, HEADER) as recording:
        recording.add(make_episode(0))
    big = replace(make_episode(1, length=BIG // 88), name="demo_0")
    with (
        pytest.raises(DatasetError, match=r"File too large.*file is unchanged"),
        Store(path, HEADER) as recording,
    ):
        recording.add(big)
    with pytest.raises(DatasetError, match="file is unchanged"):
        hdf5_writer.write_dataset(path, [big], HEADER)
    rows = RowBuffer(tmp_path)
    with pytest.raises(DatasetError, match="File too large"):
        append_rows(rows, 2 << 20)
    assert uids(path) == ["0"]
    assert left_aside(tmp_path) == []


def test_hdf5_never_sees_an_error_and_writing_one_says_it_at_the_end(
    tmp_path, short_files
):
    def write(file):
        assert file.write(b"abc") == 3
        file.seek(BIG)
        assert file.write(b"def") == 3
        file.seek(0)
        assert file.read(4) == b"abc\0"
        assert file.seek(0, 2) == BIG + 3

    with (
        pytest.raises(OSError, match="File too large"),
        open_late_errors(tmp_path / "a") as file,
    ):
        write(file)
    assert (tmp_path / "a").stat().st_size == 3
