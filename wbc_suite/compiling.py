"""`compiled`: numba's decorator with a disk cache that never serves stale code.

Numba keeps the machine code of a function as long as the function's own file is the
same; a function that it calls from another file may have changed meanwhile. Here the
cache has a folder for each state of a file and of what it imports from this package.
"""

import gc
import hashlib
import logging
import re
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import config, types

from wbc_suite.linked_code import EntryCompiler, LinkedCompiler
from wbc_suite.user_cache import user_cache

__all__ = ["announced", "cache_folder", "compiled"]
__all__ += ["compiled_inner", "compiled_unlocked", "inlined"]

log = logging.getLogger(__name__)

_numba: Any = config  # its attributes are made at import
_njit: Any = numba.njit

Function = TypeVar("Function", bound=Callable[..., Any])

_PACKAGE = Path(__file__).parent
_COMPILES = re.compile(r"^@(compiled|inlined|numba|lower_)|\bintrinsic\(", re.MULTILINE)
_IMPORT = re.compile(rf"^from ({_PACKAGE.name}[.\w]*) import", re.MULTILINE)

PATIENCE = 1.5
"""s; compiling that takes longer is announced. Reading machine code takes 0.2."""

KEPT = 7 * 24 * 3600.0
"""s; machine code that no process has asked for in this time is deleted."""


def compiled(function: Function) -> Function:
    """Compile a function on its first call.

    It keeps the interpreter's lock: another thread that wants it takes 50 us to wake up
    when it is given up, longer than most kernels take.
    """
    return _with_entry(function, nogil=False)


def compiled_unlocked(function: Function) -> Function:
    """Compile a function that takes long; other threads run meanwhile."""
    return _with_entry(function, nogil=True)


def compiled_inner(function: Function) -> Function:
    """Compile a function that only compiled functions call.

    It has no way in from Python, which takes as long to compile as the function: each
    array of each argument is taken out of its Python object there.
    """
    return cast("Function", _linked(function))


def inlined(function: Function) -> Function:
    """Compile a short function into those that call it: an inner one without a call."""
    return cast("Function", _linked(function, forceinline=True))


def _with_entry(function: Function, *, nogil: bool) -> Function:
    """Return a function with machine code for Python; others are linked to its code.

    What Python calls is kept on disk with all that it calls inside.
    """
    previous = _numba.CACHE_DIR
    _numba.CACHE_DIR = str(cache_folder(Path(function.__code__.co_filename)))
    try:
        entry = _njit(
            cache=True, nogil=nogil, error_model="numpy", pipeline_class=EntryCompiler
        )(function)
    finally:
        _numba.CACHE_DIR = previous
    inner = _linked(function)
    entry.get_call_template = inner.get_call_template
    entry.get_overload = inner.get_overload
    entry.compile = partial(_without_collecting, entry.compile)
    return cast("Function", entry)


def _without_collecting(compile_for: Callable[[Any], Any], signature: Any) -> Any:
    """Compile while no rubbish is collected: there is little, and looking takes long.

    All that a compiler builds is in use until it is done.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        return compile_for(signature)
    finally:
        if collects:
            gc.enable()


def _linked(function: Callable[..., Any], **options: bool) -> Any:
    make = _njit(
        error_model="numpy",
        pipeline_class=LinkedCompiler,
        no_cpython_wrapper=True,
        no_cfunc_wrapper=True,
        **options,
    )
    inner = make(function)
    inner.get_call_template = partial(_without_literals, inner.get_call_template)
    return inner


def _without_literals(template: Any, args: Any, keywords: Any) -> Any:
    """Ask for a function of numbers, where numba would make one for each constant."""
    return template(
        [types.unliteral(kind) for kind in args],
        {name: types.unliteral(kind) for name, kind in keywords.items()},
    )


@cache
def cache_folder(source: Path) -> Path:
    """Return where the machine code of a file's functions is kept.

    In `NUMBA_CACHE_DIR` when that is set, else in the user's cache folder, else, when
    nothing there can be written, in one that lasts as long as the process.
    """
    parent = _parent()
    folder = parent / f"{source.stem}-{_state_of(source)}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        folder.touch()
    except OSError:
        return Path(tempfile.mkdtemp(prefix="wbc_suite_"))
    return folder


@cache
def _parent() -> Path:
    parent = Path(_numba.CACHE_DIR or user_cache()) / "compiled"
    with suppress(OSError):
        _forget_old(parent)
    return parent


@contextmanager
def announced(what: str) -> Iterator[None]:
    """Say what is being compiled when that takes long.

    Counted is the processor's time: on a busy machine much else takes long as well.
    """
    start, done = time.process_time(), threading.Event()

    def watch() -> None:
        while not done.wait(0.2):
            if time.process_time() - start > PATIENCE:
                log.warning("Compiling %s, once on this machine: half a minute", what)
                return

    threading.Thread(target=watch, daemon=True).start()
    try:
        yield
    finally:
        done.set()


def _state_of(source: Path) -> str:
    """Return a digest of a file and of what it gets from other files."""
    digest = hashlib.sha256(numba.__version__.encode())
    for file in sorted(_sources(source)):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


@cache
def _sources(source: Path) -> frozenset[Path]:
    """Return a file and, through all files with compiled functions, what they import.

    Of a file without any only the constants count, and they are in the file itself.
    """
    found, waiting = {source}, [source]
    while waiting:
        text = waiting.pop().read_text()
        if _COMPILES.search(text):
            files = {_file_of(name) for name in _IMPORT.findall(text)}
            new = {file for file in files if file.is_file()} - found
            found |= new
            waiting.extend(new)
    return frozenset(found)


def _file_of(module: str) -> Path:
    place = _PACKAGE.parent.joinpath(*module.split("."))
    return place / "__init__.py" if place.is_dir() else place.with_suffix(".py")


def _forget_old(parent: Path) -> None:
    """Delete what is long unused; other processes may be writing what is not."""
    for folder in parent.iterdir():
        if time.time() - folder.stat().st_mtime > KEPT:
            shutil.rmtree(folder, ignore_errors=True)
