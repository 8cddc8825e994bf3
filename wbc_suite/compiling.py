"""Compile kernels with numba: the decorator `compiled`, and `struct` for arguments.

Machine code is kept on disk, in one folder for each state of the package's kernels.
"""

import inspect
import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from types import FunctionType
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba import types
from numba.experimental import structref

from wbc_suite.kernel_cache import cache_folder
from wbc_suite.typing import Records

log = logging.getLogger(__name__)

_untyped: Any = numba
_numba, _njit = _untyped.config, _untyped.njit
_structref: Any = structref

Function = TypeVar("Function", bound=Callable[..., Any])
Fields = TypeVar("Fields", bound=tuple[Any, ...])

PATIENCE = 1.5  # s; what compiles for longer is announced; reading the code takes 0.2
INTERVAL = 5.0  # s between two messages about the progress of compiling

_KERNELS: list[Any] = []
"""All kernels of imported modules, to report how many are compiled."""


def compiled(function: Function, *, kept: bool = True, **options: Any) -> Function:
    """Compile a function on its first call, and keep its machine code on disk.

    The function also runs as plain Python: see `plain`, or everything under
    `NUMBA_DISABLE_JIT=1`. Division by zero gives infinity or NaN, as in NumPy.

    Args:
        function: Takes numbers, arrays, tuples, and what `as_argument` returns.
        kept: Whether the machine code is kept on disk; not where an argument is a
            kernel that is made at run time, whose type no other process knows.
        options: Of numba: `nogil` releases the interpreter's lock, for long calls only
            (a thread needs up to 50 us to get it back); `inline` compiles a kernel only
            inside its callers, which are else compiled with all that it calls again.
    """
    previous = _numba.CACHE_DIR
    _numba.CACHE_DIR = str(cache_folder())
    try:
        kernel = _njit(cache=kept, error_model="numpy", **options)(function)
    finally:
        _numba.CACHE_DIR = previous
    if not _numba.DISABLE_JIT:
        _KERNELS.append(kernel)
    return cast("Function", kernel)


compiled_nogil = partial(compiled, nogil=True)
compiled_each_time = partial(compiled, kept=False)
compiled_inline = partial(compiled, inline="always")


def as_pointer(kernel: Function, *arguments: Any) -> Function:
    """Return a kernel as a value that other kernels call, whichever kernel it is.

    Kernels for equal types of arguments are one type, so that the caller is compiled
    once for all of them.

    Args:
        kernel: What `compiled` returned, a function that returns nothing.
        arguments: Examples of its arguments.
    """
    if _numba.DISABLE_JIT:
        return kernel
    return _pointer(kernel, types.void(*map(_untyped.typeof, arguments)))


@cache
def _pointer(kernel: Any, signature: Any) -> Any:
    """Compile a kernel for a signature; it lives on, as its machine code."""
    previous = _numba.CACHE_DIR
    _numba.CACHE_DIR = str(cache_folder())
    try:
        make = _untyped.cfunc(signature, cache=True, error_model="numpy")
        return make(kernel.py_func)
    finally:
        _numba.CACHE_DIR = previous


def is_compiling() -> bool:
    """Return whether numba compiles kernels: not under `NUMBA_DISABLE_JIT=1`."""
    return not _numba.DISABLE_JIT


def readable(records: Records) -> Records:
    """Return records whose fields plain Python reads as kernels do, if it has to."""
    return records if is_compiling() else records.view(np.recarray)


def plain(kernel: Any) -> Any:
    """Return a kernel, and all kernels that it calls, as plain Python functions."""
    function = getattr(kernel, "py_func", None) or inspect.unwrap(kernel)
    names = dict(function.__globals__)
    for name in set(function.__code__.co_names) & set(names):
        if any(names[name] is kernel for kernel in _KERNELS):
            names[name] = plain(names[name])
    return FunctionType(function.__code__, names, function.__name__)


def struct(fields: type[Fields]) -> type[Fields]:
    """Let kernels take a named tuple of arrays and numbers as one argument.

    Numba unpacks each array of a tuple for each call, and compiles that code again in
    each function. A `structref` is one pointer. `as_argument` makes it of a tuple;
    plain Python takes the tuple itself, since fields are read by the same names.

    Args:
        fields: A `NamedTuple` class at the top level of a module.
    """
    names: Any = fields
    module, qualname = fields.__module__, fields.__qualname__
    for name, base in (
        ("numba_type", _StructType),
        ("proxy", _structref.StructRefProxy),
    ):
        place = {"__module__": module, "__qualname__": f"{qualname}.{name}"}
        setattr(names, name, type(f"{fields.__name__}_{name}", (base,), place))
    proxy = names.proxy
    _structref.register(names.numba_type)
    _structref.define_proxy(proxy, names.numba_type, list(names._fields))

    def pack(values: Any) -> Any:
        return proxy(*values)

    # Numba names cache files by these: one for each class, for reading an index fails
    # where the module of one of its types cannot be imported.
    pack.__module__, pack.__qualname__ = module, f"{qualname}.pack"
    names.pack = staticmethod(pack if _numba.DISABLE_JIT else compiled(pack))
    return fields


def as_argument(values: Fields) -> Fields:
    """Return the argument of a kernel that stands for a tuple of a `struct` class.

    Arrays are shared, numbers are copied; fields that are such tuples are converted
    too. Without compilation it is the tuple itself.
    """
    if _numba.DISABLE_JIT:
        return values
    fields = [as_argument(x) if hasattr(x, "pack") else x for x in values]
    kind: Any = type(values)
    return kind.pack(kind(*fields))


class _StructType(types.StructRef):
    """A record whose fields have the types of the arrays that it was made of."""

    def preprocess_fields(self, fields: Any) -> Any:
        """Return the fields with types of numbers in place of those of constants."""
        return tuple((name, types.unliteral(kind)) for name, kind in fields)


@contextmanager
def announced(what: str) -> Iterator[None]:
    """Log what is being compiled, and how far it is, when that takes long.

    The processor's time counts: a busy machine does not cause a message.
    """
    start, done = time.process_time(), threading.Event()

    def watch() -> None:
        said = PATIENCE
        while not done.wait(0.2):
            spent = time.process_time() - start
            if spent > said:
                said = spent + INTERVAL
                count = sum(bool(kernel.signatures) for kernel in list(_KERNELS))
                log.warning(
                    "Compiling %s, once on this machine, about half a minute: "
                    "%d of %d functions after %.0f s",
                    *(what, count, len(_KERNELS), spent),
                )

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
