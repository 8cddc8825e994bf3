"""What is on the disk after a power failure: all of a file, or nothing of it.

A disk keeps what was synced: the content of a file by its own `fsync`, and its name by
the one of its folder. So a file is synced before it is renamed, and its folder after.
"""

import os
import stat
from pathlib import Path

import pytest
from random_episodes import HEADER, make_episode

from wbc_suite import atomic_files
from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, Store
from wbc_suite.recording.converting import convert


class Disk:
    """Notes syncs and renames, in order.

    Attributes:
        events: ("sync", inode, content), ("sync folder", inode) and
            ("rename", inode, content, inode of the folder, name).
    """

    def __init__(self, monkeypatch):
        self.events = []
        self._fsync, self._replace = os.fsync, os.replace
        monkeypatch.setattr(os, "fsync", self.fsync)
        monkeypatch.setattr(os, "replace", self.replace)
        monkeypatch.setattr(os, "rename", self.replace)

    def fsync(self, handle):
        found = os.fstat(handle)
        if stat.S_ISDIR(found.st_mode):
            self.events.append(("sync folder", found.st_ino))
        else:
            content = os.pread(handle, found.st_size, 0)
            self.events.append(("sync", found.st_ino, content))
        self._fsync(handle)

    def replace(self, source, target, **options):
        path, final = Path(source), Path(target)
        content = b"" if path.is_dir() else path.read_bytes()
        places = path.stat().st_ino, content, final.parent.stat().st_ino
        self.events.append(("rename", *places, final.name))
        self._replace(source, target, **options)

    def renames(self):
        return [event for event in self.events if event[0] == "rename"]

    def is_safe(self, rename):
        """Return whether the file was synced as it is before, its folder after."""
        at = self.events.index(rename)
        _, inode, content, folder, _ = rename
        before, after = self.events[:at], self.events[at:]
        return ("sync", inode, content) in before and ("sync folder", folder) in after


@pytest.fixture
def disk(monkeypatch):
    return Disk(monkeypatch)


def test_a_file_is_written_synced_renamed_and_its_folder_synced(tmp_path, disk):
    path = tmp_path / "a.txt"
    path.write_bytes(b"old")
    atomic_files.write_bytes(path, b"new content")
    assert path.read_bytes() == b"new content"
    kinds = [event[0] for event in disk.events]
    assert kinds == ["sync", "rename", "sync folder"]
    (rename,) = disk.renames()
    assert disk.is_safe(rename)
    assert rename[2:] == (b"new content", tmp_path.stat().st_ino, "a.txt")


def test_a_sync_that_fails_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.txt"
    path.write_bytes(b"old")

    def fail(handle):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(DatasetError, match=r"Input/output error.*unchanged"):
        atomic_files.write_bytes(path, b"new")
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["a.txt"]


def test_new_folders_are_on_the_disk_before_files_in_them(tmp_path, disk):
    folder = tmp_path / "a" / "b"
    atomic_files.check_folder(folder)
    inodes = [path.stat().st_ino for path in (tmp_path, tmp_path / "a")]
    synced = [event[1] for event in disk.events if event[0] == "sync folder"]
    assert sorted(synced) == sorted(inodes)
    disk.events.clear()
    atomic_files.check_folder(folder)
    assert disk.events == []


def test_each_episode_is_on_the_disk_before_the_next_begins(tmp_path, disk):
    path = tmp_path / "a.hdf5"
    store = Store(path, HEADER)
    for seed in range(3):
        disk.events.clear()
        store.add(make_episode(seed))
        (rename,) = disk.renames()
        assert disk.is_safe(rename)
        assert rename[4] == f"episode_{seed:09d}.hdf5"
    disk.events.clear()
    store.close()
    (rename,) = disk.renames()
    assert disk.is_safe(rename)
    assert rename[4] == "a.hdf5"
    with Dataset(path) as dataset:
        assert len(dataset) == 3


@pytest.mark.parametrize(("layout", "count"), [("npz", 2), ("robomimic", 1)])
def test_each_file_of_another_layout_is_on_the_disk(layout, count, tmp_path, disk):
    """Files may then be moved into place, as they are."""
    path = tmp_path / "a.hdf5"
    with Store(path, HEADER) as store:
        for seed in range(2):
            store.add(make_episode(seed))
    disk.events.clear()
    convert(path, tmp_path / "out", layout)
    files = [event for event in disk.renames() if event[2]]
    written = {event[1:3] for event in files if disk.is_safe(event)}
    assert {event[1:3] for event in files} == written
    assert len(written) == count
