"""Machine code on disk: chosen folder, damaged files, folders without permission."""

import json
import os
import pickle
import shutil
import stat
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from wbc_suite import catalogue, kernel_cache

USE = """
import use_kernel
from wbc_suite.kernel_cache import cache_folder
print(cache_folder())
print(sum(use_kernel.double.stats.cache_hits.values()))
"""
KERNEL = """
from wbc_suite.compiling import compiled

@compiled
def double(x):
    return 2.0 * x

assert double(2.0) == 4.0
"""
FILES = {"a.nbi", "a.1.nbc", "b.nbi", "b.1.nbc"}


@pytest.fixture
def machine_code(monkeypatch, tmp_path):
    """Machine code is kept in an empty folder."""
    monkeypatch.setattr(kernel_cache, "user_cache", lambda: tmp_path)
    monkeypatch.setattr("numba.config.CACHE_DIR", "")
    kernel_cache.cache_folder.cache_clear()
    yield tmp_path / "compiled"
    kernel_cache.cache_folder.cache_clear()


@pytest.fixture
def temporary(monkeypatch, tmp_path):
    """Temporary files are kept in an empty folder."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def run(tmp_path):
    """Run a process that uses one kernel; return its folder and its cache hits."""
    (tmp_path / "use_kernel.py").write_text(KERNEL)
    root = Path(kernel_cache.__file__).parent.parent

    def start(command=(), **environment):
        paths = os.pathsep.join(map(str, (root, tmp_path)))
        result = subprocess.run(
            [*command, sys.executable, "-c", USE],
            env={"PATH": os.environ["PATH"], "PYTHONPATH": paths} | environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert result.returncode == 0, result.stderr
        folder, hits = result.stdout.splitlines()[-2:]
        return Path(folder), int(hits)

    return start


def test_changed_kernels_get_another_folder(machine_code, monkeypatch, tmp_path):
    """The folder depends on files with kernels, and on no other."""
    source = Path(kernel_cache.__file__).parent
    package = tmp_path / source.name
    package.mkdir()
    for name in ("compiling.py", "errors.py", "qp/lie.py"):
        (package / name).parent.mkdir(exist_ok=True)
        shutil.copy(source / name, package / name)
    monkeypatch.setattr(kernel_cache, "__file__", str(package / "kernel_cache.py"))

    def folder_after_change(name):
        with (package / name).open("a") as file:
            file.write("# changed\n")
        kernel_cache.cache_folder.cache_clear()
        return kernel_cache.cache_folder()

    first = folder_after_change("errors.py")
    assert first.parent == machine_code
    assert folder_after_change("errors.py") == first
    assert folder_after_change("qp/lie.py") != first


def test_machine_code_that_is_long_unused_is_deleted(machine_code):
    for age, name in ((0.5, "recent"), (1.5, "old")):
        folder = machine_code / name
        folder.mkdir(parents=True)
        then = time.time() - age * kernel_cache.KEPT
        os.utime(folder, (then, then))
    present = kernel_cache.cache_folder().name
    kept = {folder.name for folder in machine_code.iterdir()}
    assert kept == {present, "recent"}


def test_a_folder_that_cannot_be_written_is_replaced(
    monkeypatch, tmp_path, temporary, machine_code
):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setattr("numba.config.CACHE_DIR", str(blocked))
    folder = kernel_cache.cache_folder()
    assert folder.is_relative_to(temporary)
    assert stat.S_IMODE(catalogue.temporary_root().stat().st_mode) == 0o700
    kernel_cache.cache_folder.cache_clear()
    assert kernel_cache.cache_folder() == folder  # nothing piles up


def test_a_temporary_folder_of_others_is_not_used(
    monkeypatch, tmp_path, temporary, machine_code
):
    """Whoever can write there could make this process run anything."""
    monkeypatch.setattr("numba.config.CACHE_DIR", "/dev/null")
    catalogue.temporary_root().mkdir()
    catalogue.temporary_root().chmod(0o777)
    folder = kernel_cache.cache_folder()
    assert not folder.is_relative_to(catalogue.temporary_root())
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_abandoned_temporary_files_are_deleted(machine_code):
    folder = kernel_cache.cache_folder() / "wbc_suite_1"
    folder.mkdir()
    old, new = folder / "a.nbc.tmp.1", folder / "a.nbc.tmp.2"
    for file, age in ((old, 2 * kernel_cache.TORN), (new, 0.0)):
        file.touch()
        os.utime(file, (time.time() - age,) * 2)
    kernel_cache.cache_folder.cache_clear()
    kernel_cache.cache_folder()
    assert not old.exists()
    assert new.exists()


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize(
    ("name", "damage"),
    [
        ("a.1.nbc", lambda whole: b""),
        ("a.1.nbc", lambda whole: whole[:-20]),
        ("a.1.nbc", lambda whole: bytes(len(whole))),
        ("a.nbi", lambda whole: whole[:-20]),
        ("a.nbi", lambda whole: b"text"),
        ("a.1.nbc", None),
    ],
)
def test_damaged_files_are_deleted_and_whole_ones_kept(
    machine_code, name, damage, known
):
    folder = kernel_cache.cache_folder() / "wbc_suite_1"
    folder.mkdir()
    whole = pickle.dumps("0.1") + pickle.dumps({"key": b"code" * 100})
    for each in FILES:
        (folder / each).write_bytes(whole)
    if known:
        kernel_cache.cache_folder.cache_clear()
        kernel_cache.cache_folder()
    if damage is None:
        (folder / name).unlink()
        (folder / name).mkdir()
    else:
        (folder / name).write_bytes(damage(whole))
    kernel_cache.cache_folder.cache_clear()
    kernel_cache.cache_folder()
    kept = {file.name for file in folder.iterdir()}
    assert kept == FILES - {name}


def flip(file, *, keep_time):
    """Change one bit of a file, which stays a whole pickle; size and time are kept."""
    content, found = bytearray(file.read_bytes()), file.stat()
    content[len(content) // 2] ^= 1
    file.write_bytes(content)
    if keep_time:
        os.utime(file, ns=(found.st_atime_ns, found.st_mtime_ns))


@pytest.mark.parametrize("keep_time", [True, False])
@pytest.mark.parametrize("name", ["a.1.nbc", "a.nbi"])
def test_a_flipped_bit_is_found(machine_code, name, keep_time):
    folder = kernel_cache.cache_folder() / "wbc_suite_1"
    folder.mkdir()
    for each in FILES:
        (folder / each).write_bytes(pickle.dumps(b"code" * 100))
    kernel_cache.cache_folder.cache_clear()
    kernel_cache.cache_folder()
    flip(folder / name, keep_time=keep_time)
    kernel_cache.cache_folder.cache_clear()
    kernel_cache.cache_folder()
    assert {file.name for file in folder.iterdir()} == FILES - {name}


def test_a_copied_cache_is_used(machine_code):
    """A copy has other times, as in an image or after a checkout."""
    folder = kernel_cache.cache_folder() / "wbc_suite_1"
    folder.mkdir()
    for each in FILES:
        (folder / each).write_bytes(pickle.dumps(b"code" * 100))
    kernel_cache.cache_folder.cache_clear()
    kernel_cache.cache_folder()
    for each in FILES:
        os.utime(folder / each, (1.0, 1.0))
    kernel_cache.cache_folder.cache_clear()
    kernel_cache.cache_folder()
    assert {file.name for file in folder.iterdir()} == FILES


def test_machine_code_that_numba_wrote_again_is_kept(machine_code):
    """As after a change of a user's kernel: the index changes too."""
    folder = kernel_cache.cache_folder() / "wbc_suite_1"
    folder.mkdir()
    for content in (b"code", b"other code"):
        for name in ("a.nbi", "a.1.nbc"):
            (folder / name).write_bytes(pickle.dumps(content))
        kernel_cache.cache_folder.cache_clear()
        kernel_cache.cache_folder()
    assert len(list(folder.iterdir())) == 2


@pytest.mark.parametrize(
    "content",
    [*("", "[1]", "3", '{"a": 1}', "\x00", "[" * 5000), '{"a": [1, "b"]}', '{"a": {}}'],
)
def test_a_damaged_list_of_checked_files_is_written_anew(machine_code, content):
    folder = kernel_cache.cache_folder()
    (folder / "a.1.nbc").write_bytes(pickle.dumps(b"code"))
    (folder / kernel_cache.CHECKED).write_text(content)
    kernel_cache.cache_folder.cache_clear()
    kernel_cache.cache_folder()
    assert list(json.loads((folder / kernel_cache.CHECKED).read_text())) == ["a.1.nbc"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_a_process_starts_with_a_damaged_cache(run, tmp_path, kind):
    cache = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    folder, hits = run(**cache)
    assert hits == 0
    assert run(**cache) == (folder, 1)
    for file in folder.rglob(f"*double*.{kind}"):
        file.write_bytes(file.read_bytes()[:-100])
    assert run(**cache) == (folder, 0)
    assert run(**cache) == (folder, 1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_a_process_starts_after_a_bit_was_flipped(run, tmp_path, kind):
    """Also where no process has started since the one that compiled."""
    cache = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    folder, _ = run(**cache)
    for _ in range(2):
        for file in folder.rglob(f"*double*.{kind}"):
            flip(file, keep_time=True)
        assert run(**cache) == (folder, 0)
        assert run(**cache) == (folder, 1)


@pytest.mark.slow
def test_a_read_only_cache_is_used(run, tmp_path):
    """As root nothing is read-only, so that the cache is that of a mount or a user."""
    cache = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "TMPDIR": str(tmp_path / "tmp")}
    (tmp_path / "tmp").mkdir()
    folder, _ = run(**cache)
    command = ()
    if os.getuid() == 0:
        command = ("setpriv", "--reuid=65534", "--clear-groups", "--inh-caps=-all")
        if shutil.which("setpriv") is None:
            pytest.skip("root can write everywhere, and setpriv is missing")
        (tmp_path / "tmp").chmod(0o777)
        for parent in (tmp_path, *tmp_path.parents[:3]):
            parent.chmod(parent.stat().st_mode | 0o055)
    for path in (folder, *folder.rglob("*")):
        path.chmod(0o555 if path.is_dir() else 0o444)
    (tmp_path / "cache/wbc_suite/compiled").chmod(0o555)
    for _ in range(2):
        used, hits = run(command, **cache)
        assert hits == 1
        assert used.is_relative_to(tmp_path / "tmp")
    assert len(list((tmp_path / "tmp").iterdir())) == 1
    for path in (folder, *folder.rglob("*"), folder.parent):
        path.chmod(0o755)


@pytest.mark.slow
def test_a_user_without_home_has_a_cache(run, tmp_path):
    environment = {"TMPDIR": str(tmp_path)}
    command = ()
    if os.getuid() == 0 and shutil.which("setpriv"):  # a user without passwd entry
        command = ("setpriv", "--reuid=54321", "--clear-groups")
        for parent in (tmp_path, *tmp_path.parents[:3]):
            parent.chmod(0o777)
    run(command, **environment)
    folder, hits = run(command, **environment)
    assert hits == 1
    assert folder.is_relative_to(tmp_path) or not command
