"""The folder where numba keeps machine code: chosen, checked and cleaned.

numba reads these files without a check: a damaged one would end every start, and one of
another user could hold anything. So files are checked when they are new or changed, and
folders are private.
"""

import atexit
import hashlib
import io
import json
import os
import pickletools
import shutil
import stat
import tempfile
import time
import zlib
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import UserProvidedCacheLocator

from wbc_suite.catalogue import temporary_root, user_cache

_untyped: Any = numba

PACKAGE = Path(__file__).parent

KEPT = 7 * 24 * 3600.0  # s; code that no process asks for in this time is deleted
TORN = 3600.0  # s; a file that is still being written after this was abandoned
ROOM = 1 << 16  # bytes that must fit on the disk
CHECKED = "checked.json"
"""Size, time of change and CRC-32 of each file, by name, when it was checked."""
KERNELS = b"wbc_suite.compiling" + b" import"  # in two, for this file has no kernels


class PackageLocator(UserProvidedCacheLocator):
    """Tell numba where it finds a kernel of this package, whichever copy runs.

    Numba names a folder after the path of the source, and compares its time. This one
    is named after the module, and its parent after the state of all kernels: copies of
    the package, such as on a cluster or in an image, read the same files. Numba's
    `CACHE_LOCATOR_CLASSES` names this class while a kernel is made.
    """

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        module = Path(py_file).relative_to(PACKAGE).with_suffix("")
        self._cache_path = str(cache_folder() / ".".join(module.parts))

    def get_source_stamp(self) -> bytes:
        """Return nothing: the folder changes with the source."""
        return b""


@cache
def cache_folder() -> Path:
    """Return where machine code is kept, which depends on the state of the kernels.

    In `NUMBA_CACHE_DIR` when that is set, else in the user's cache folder. Where that
    cannot be written, in a temporary folder of this user, with links to what the other
    one holds; else in one that is removed when the process ends.
    """
    digest = _kernels_digest()
    preferred = Path(_untyped.config.CACHE_DIR or user_cache()) / "compiled" / digest
    for folder in (preferred, temporary_root() / "compiled" / digest):
        with suppress(OSError):
            _prepare(folder)
            if folder != preferred:
                _link(preferred, folder)
            _drop_damaged(folder)
            atexit.register(_drop_damaged, folder, reread=False)
            _drop_old(folder.parent)
            return folder
    folder = Path(tempfile.mkdtemp(prefix="wbc_suite_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _prepare(folder: Path) -> None:
    """Create a folder; raises OSError if it is another user's, or cannot be written."""
    if folder.is_relative_to(temporary_root()):
        temporary_root().mkdir(mode=0o700, exist_ok=True)
        found = temporary_root().lstat()
        private = found.st_uid == os.getuid() and not found.st_mode & 0o077
        if not (stat.S_ISDIR(found.st_mode) and private):
            raise PermissionError(f"'{temporary_root()}' is not private.")
    folder.mkdir(parents=True, exist_ok=True)
    folder.touch()
    with tempfile.TemporaryFile(dir=folder) as file:
        file.write(bytes(ROOM))


def _link(source: Path, folder: Path) -> None:
    """Link the files of a folder that cannot be written into another one."""
    for file in source.rglob("*.nb[ic]"):
        link = folder / file.relative_to(source)
        link.parent.mkdir(exist_ok=True)
        with suppress(FileExistsError):
            link.symlink_to(file)


def _drop_damaged(folder: Path, *, reread: bool = True) -> None:
    """Delete files that are no whole pickles, or were changed since they were checked.

    A flipped bit leaves size, time and a whole pickle, so that contents are compared:
    30 ms for 70 MB. At the end of a process only what it compiled is read, so that the
    next start can compare it.
    """
    known = _checked(folder)
    files = {_name(file, folder): file for file in folder.rglob("*.nb[ic]")}
    states = {name: _state(file) for name, file in files.items()}
    written = _written(known, states)
    checked: dict[str, list[int]] = {}
    for name, file in files.items():
        before = known.get(name, [])
        if before[:2] == states[name] and not reread:
            checked[name] = before
            continue
        with suppress(OSError):
            content = file.read_bytes()
            now = [*states[name], zlib.crc32(content)]
            same = before[::2] == now[::2]
            if same or (name in written and _is_whole(content)):
                checked[name] = now
                continue
        with suppress(OSError):
            shutil.rmtree(file) if file.is_dir() else file.unlink()
    if checked != known:
        with suppress(OSError):
            with tempfile.NamedTemporaryFile("w", dir=folder, delete=False) as new:
                json.dump(checked, new)
            Path(new.name).replace(folder / CHECKED)


def _checked(folder: Path) -> dict[str, list[int]]:
    """Return what is known of each file; nothing if the list is missing or damaged."""
    try:
        return {
            str(name): [int(number) for number in state]
            for name, state in json.loads((folder / CHECKED).read_text()).items()
            if len(state) == 3
        }
    except (OSError, ValueError, TypeError, AttributeError, RecursionError):
        return {}


def _written(
    known: Mapping[str, list[int]], states: Mapping[str, list[int]]
) -> set[str]:
    """Return the files that are new, or that numba has written again.

    numba writes an index (.nbi), and then the machine code (.nbc) that is new in it.
    Where only one of the two has changed, it was not numba.
    """
    changed = {name for name in states if known.get(name, [])[:2] != states[name]}
    indices = {_index(name) for name in changed if name.endswith(".nbc")} & changed
    new = {name for name in states if name not in known}
    return new | {name for name in changed if _index(name) in indices}


def _index(name: str) -> str:
    """Return the name of the index of a file of machine code; of an index its own."""
    return name if name.endswith(".nbi") else f"{name.rsplit('.', 2)[0]}.nbi"


def _name(file: Path, folder: Path) -> str:
    return file.relative_to(folder).as_posix()


def _state(file: Path) -> list[int]:
    """Return the size and the time of the last change; nothing if it is gone."""
    try:
        found = file.stat()
    except OSError:
        return []
    return [found.st_size, found.st_mtime_ns]


def _is_whole(content: bytes) -> bool:
    """Return whether a file consists of pickles, without running them."""
    stream = io.BytesIO(content)
    try:
        while stream.tell() < len(content):
            for _ in pickletools.genops(stream):
                pass
    except (ValueError, EOFError, MemoryError):
        return False
    return bool(content)


def _drop_old(parent: Path) -> None:
    """Delete folders that no process has asked for lately, and abandoned files."""
    now = time.time()
    with suppress(OSError):
        for other in parent.iterdir():
            if now - other.stat().st_mtime > KEPT:
                shutil.rmtree(other, ignore_errors=True)
        for file in parent.glob("*/*/*.tmp.*"):
            if now - file.stat().st_mtime > TORN:
                file.unlink()


def _kernels_digest() -> str:
    """Return a digest of all source files that hold kernels, and of numba's version.

    Numba compiles a function again when its own file changes, not when a function
    changes that it calls from another file.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for file in sorted(Path(__file__).parent.rglob("*.py")):
        source = file.read_bytes()
        if KERNELS in source or file.name == "compiling.py":
            digest.update(source)
    return digest.hexdigest()[:16]
