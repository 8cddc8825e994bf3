"""Files that make HDF5 loop, crash or take memory are refused by a child process."""

import os
import struct
import subprocess
import sys

import h5py
import pytest

from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, editing, hdf5_check
from wbc_suite.recording.hdf5_check import check_files, open_safely

FREE = 0
"""Number of the free space in a heap."""


def texts(content):
    """Yield the offset of each text's size in the heaps, and its number.

    Source: HDF5 File Format Specification 3.0, section III.E (global heap).
    """
    heap = content.find(b"GCOL")
    while heap >= 0:
        (size,) = struct.unpack_from("<Q", content, heap + 8)
        at = heap + 16
        while at + 16 <= heap + size:
            number, _, length = struct.unpack_from("<HH4xQ", content, at)
            yield at + 8, number
            at += 16 + -(-length // 8) * 8 if number else length
        heap = content.find(b"GCOL", heap + 1)


def damage_text(path, size, *, free):
    content = bytearray(path.read_bytes())
    place = next(at for at, n in texts(content) if (n == FREE) == free)
    struct.pack_into("<Q", content, place, size)
    path.write_bytes(content)


@pytest.fixture
def short_limit(monkeypatch):
    monkeypatch.setattr(hdf5_check, "CPU_SECONDS", 2)


@pytest.fixture
def child_code(monkeypatch):
    """Let the child run other code."""
    return lambda code: monkeypatch.setattr(hdf5_check, "COMMAND", code)


@pytest.mark.slow
def test_recordings_pass_and_cost_one_child(small_recording, tmp_path, monkeypatch):
    run, started = subprocess.run, []

    def counted(command, **options):
        started.append(options["input"].count(b"\0") + 1)
        return run(command, **options)

    monkeypatch.setattr(hdf5_check.subprocess, "run", counted)
    copies = [tmp_path / f"{k}.hdf5" for k in range(30)]
    for copy in copies:
        copy.write_bytes(small_recording.read_bytes())
    check_files([*copies, tmp_path / "missing.hdf5"])
    assert started == [30]
    with open_safely(small_recording) as file:
        assert "data" in file


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "free"), [(0, True), (1, True), (2**64 - 16, False), (2**63, False)]
)
def test_a_text_size_that_hangs_hdf5_is_refused(
    small_recording, short_limit, size, free
):
    damage_text(small_recording, size, free=free)
    with pytest.raises(DatasetError, match=r"small\.hdf5' "):
        Dataset(small_recording)
    findings = editing.verify(small_recording)
    assert any(finding.problem for finding in findings)


@pytest.mark.slow
def test_the_file_that_hangs_is_named_among_many(
    small_recording, tmp_path, short_limit
):
    good = tmp_path / "good.hdf5"
    good.write_bytes(small_recording.read_bytes())
    damage_text(small_recording, 0, free=True)
    with pytest.raises(DatasetError, match=r"small\.hdf5' is damaged.* read in 2 s"):
        check_files([good, small_recording])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", r"crashes.*SEGV"),
        ("while True: pass", "cannot be read in 2 s"),
        ("import wbc_suite.none", "cannot be checked.*wbc_suite.none"),
    ],
)
def test_what_ends_the_child_is_reported(
    small_recording, short_limit, child_code, code, message
):
    limit = "import resource; resource.setrlimit(resource.RLIMIT_CPU, (2, 3))\n"
    child_code(limit + code)
    with pytest.raises(DatasetError, match=message):
        check_files([small_recording])


@pytest.mark.parametrize(("size", "seconds"), [(1000, 10), (55_000_000, 15)])
def test_a_child_has_10_s_and_one_more_for_10_mb_and_ten_times_as_long_to_wait(
    tmp_path, monkeypatch, size, seconds
):
    path, given = tmp_path / "a.hdf5", {}
    with path.open("wb") as file:
        file.truncate(size)

    def run(command, **options):
        given.update(options, seconds=command[-1])
        return subprocess.CompletedProcess(command, 0, b"", b"")

    monkeypatch.setattr(hdf5_check.subprocess, "run", run)
    check_files([path])
    assert given["seconds"] == str(seconds)
    assert given["timeout"] == 10 * seconds


@pytest.mark.slow
def test_a_child_that_waits_is_killed(small_recording, monkeypatch, child_code):
    child_code("import signal; signal.pause()")
    monkeypatch.setattr(hdf5_check, "CPU_SECONDS", 1)
    monkeypatch.setattr(hdf5_check, "WALL_FACTOR", 1)
    with pytest.raises(DatasetError, match="is damaged"):
        check_files([small_recording])


@pytest.mark.slow
def test_a_child_without_memory_is_reported(small_recording, child_code):
    child_code(
        "from wbc_suite.recording import hdf5_check as check\n"
        "def fail(path): bytearray(1 << 40)\n"
        "check._read_structure = fail\n"
        "check.read_files()"
    )
    with pytest.raises(DatasetError, match="takes more than 4 GiB"):
        check_files([small_recording])


@pytest.mark.slow
def test_the_child_imports_no_simulator(small_recording, child_code):
    child_code(
        f"{hdf5_check.COMMAND}\nimport sys\n"
        "heavy = {'numba', 'mujoco', 'pinocchio'} & set(sys.modules)\n"
        "sys.exit(f'imports {heavy}' if heavy else 0)"
    )
    check_files([small_recording])


@pytest.mark.slow
def test_a_loop_of_groups_ends(small_recording):
    with h5py.File(small_recording, "r+") as file:
        file["data/demo_0/again"] = file["data"]
    check_files([small_recording])


@pytest.mark.slow
def test_the_folder_of_the_user_is_not_searched_for_modules(
    small_recording, tmp_path, monkeypatch
):
    (tmp_path / "h5py.py").write_text("raise SystemExit('foreign code runs')")
    monkeypatch.chdir(tmp_path)
    check_files([small_recording])


def test_nothing_is_started_for_files_of_this_process(small_recording, monkeypatch):
    monkeypatch.setattr(sys, "executable", os.devnull)
    with Dataset(small_recording, checked=True) as dataset:
        assert len(dataset) == 4
    check_files([small_recording.with_name("missing.hdf5")])


def test_a_sparse_file_is_refused(tmp_path):
    path = tmp_path / "bomb.hdf5"
    with path.open("wb") as file:
        file.truncate(2 << 30)
    with pytest.raises(DatasetError, match="declares 2147483648 bytes"):
        open_safely(path, checked=True)


def test_the_child_imports_no_robots():
    """It starts for each file that is opened."""
    code = (
        "import sys, wbc_suite.recording.hdf5_check;"
        "print([m for m in sys.modules if m in ('numba', 'mujoco', 'pydantic')])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.stdout.strip() == "[]", run.stderr
