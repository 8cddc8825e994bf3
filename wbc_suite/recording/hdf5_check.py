"""A trial read of HDF5 files in a child process, before this process opens them.

HDF5 trusts the sizes that a file declares: a damaged one can make it loop without end,
crash or take all memory. The child reads the structure, the attributes, the names and
the headers of all datasets under limits of time and memory. Numbers are not read.
"""

import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import h5py

import wbc_suite
from wbc_suite.errors import DatasetError
from wbc_suite.files import check_file
from wbc_suite.recording import hdf5_reader

CPU_SECONDS = 10  # processor time for the start and for small files, s
BYTES_PER_SECOND = 10_000_000  # larger files get one second more for so many bytes
MEMORY_BYTES = 4 << 30  # address space of the child
WALL_FACTOR = 10  # wall time over processor time, for a busy machine or a slow disk
SPARSE_FROM, SPARSE = 1 << 30, 20  # larger files with less than 1/20 on disk: bombs
OUT_OF_MEMORY = 3  # exit code of the child
TOLERATED = (*hdf5_reader.ERRORS, DatasetError)  # which the parent meets, too
T = TypeVar("T")
COMMAND = "from wbc_suite.recording.hdf5_check import read_files; read_files()"


def open_safely(path: Path, *, checked: bool = False) -> h5py.File:
    """Open a file for reading, after `check_files` unless it was `checked` before.

    Raises:
        DatasetError: If it is missing, no HDF5 file or too damaged to be read.
    """
    if not path.exists():
        raise DatasetError(f"There is no file '{path}'.")
    size = check_file(path, error=DatasetError)
    held = getattr(size, "st_blocks", size.st_size) * 512
    if size.st_size > SPARSE_FROM and held * SPARSE < size.st_size:
        raise DatasetError(f"'{path}' declares {size.st_size} bytes, but holds {held}.")
    if not h5py.is_hdf5(path):
        raise DatasetError(
            f"'{path}' is not an HDF5 file, or its start is damaged. If it was "
            "being recorded, `wbc-suite repair` restores finished episodes."
        )
    if not checked:
        check_files([path])
    with hdf5_reader.reading(path):
        return h5py.File(path, "r")


def check_files(paths: Sequence[Path]) -> None:
    """Read files in one child process; missing files are skipped.

    Raises:
        DatasetError: If the child ran into a limit or crashed; it names the file.
    """
    paths = [path for path in paths if path.is_file()]
    if not paths:
        return
    size = sum(path.stat().st_size for path in paths)
    seconds = CPU_SECONDS + size // BYTES_PER_SECOND
    roots = [str(Path(wbc_suite.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    search_path = os.pathsep.join(filter(None, roots))
    environment = os.environ | {"PYTHONPATH": search_path, "OPENBLAS_NUM_THREADS": "1"}
    try:
        child = subprocess.run(
            [sys.executable, "-P", "-c", COMMAND, str(seconds)],
            input=b"\0".join(os.fsencode(path.absolute()) for path in paths),
            capture_output=True,
            timeout=WALL_FACTOR * seconds,
            env=environment,
            check=False,
        )
        code, output, messages = child.returncode, child.stdout, child.stderr
    except subprocess.TimeoutExpired as error:
        code, output, messages = -signal.SIGXCPU, error.stdout or b"", b""
    if code != 0:
        damaged = paths[min(output.count(b"\n"), len(paths) - 1)]
        raise DatasetError(f"'{damaged}' {_reason(code, seconds, messages)}")


def _reason(code: int, seconds: int, messages: bytes) -> str:
    """Return why the child failed, as the end of a sentence about the file."""
    if code in (-signal.SIGXCPU, -signal.SIGKILL):
        return f"is damaged: its structure cannot be read in {seconds} s."
    if code == OUT_OF_MEMORY:
        return f"is damaged: its structure takes more than {MEMORY_BYTES >> 30} GiB."
    if code < 0:
        name = signal.Signals(-code).name
        return f"is damaged: HDF5 crashes while reading it ({name})."
    last = messages.decode(errors="replace").strip().splitlines()[-1:]
    return f"cannot be checked in a child process: {''.join(last)}"


def read_files() -> None:
    """Read the files named by standard input, in the child; write a line for each."""
    seconds = int(sys.argv[1])
    _limit(resource.RLIMIT_CPU, seconds)
    _limit(resource.RLIMIT_AS, MEMORY_BYTES)
    _limit(resource.RLIMIT_CORE, 0)
    try:
        for name in sys.stdin.buffer.read().split(b"\0"):
            with suppress(*TOLERATED):
                _read_structure(Path(os.fsdecode(name)))
            os.write(1, b"\n")
    except MemoryError:
        sys.exit(OUT_OF_MEMORY)


def _limit(kind: int, value: int) -> None:
    """Lower a limit of this process, which may have a lower one."""
    known = [x for x in resource.getrlimit(kind) if x != resource.RLIM_INFINITY]
    least = min([value, *known])
    resource.setrlimit(kind, (least, least))


def _read_structure(path: Path) -> None:
    with h5py.File(path, "r") as file:
        groups, seen = [h5py.Group(file.id)], set()
        while groups:
            group = groups.pop()
            if group in seen:  # by another name, or a cycle
                continue
            seen.add(group)
            _read_attributes(group)
            for name in _tried(hdf5_reader.child_names, group) or ():
                node = _tried(hdf5_reader.child, group, name, h5py.HLObject)
                if isinstance(node, h5py.Group):
                    groups.append(node)
                elif isinstance(node, h5py.Dataset):
                    _read_attributes(node)
                    _tried(hdf5_reader.read_names, node)


def _read_attributes(node: h5py.Group | h5py.Dataset) -> None:
    for name in _tried(hdf5_reader.attribute_names, node) or ():
        _tried(hdf5_reader.attribute, node, name)


def _tried(read: Callable[..., T], *arguments: Any) -> T | None:
    """Return what a function reads, or None after an error that h5py reports."""
    with suppress(*TOLERATED):
        return read(*arguments)
    return None
