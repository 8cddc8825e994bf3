"""Compile kernels with numba: the decorator `compiled`, and `struct` for arguments.

Machine code is kept on disk, in one folder for each state of the package's kernels.
"""

import ctypes
import gc
import inspect
import logging
import time
import warnings
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from types import FunctionType
from typing import Any, ClassVar, TypeVar, cast, get_args, get_type_hints

import numba
import numpy as np
from numba import errors, types
from numba.core import event
from numba.experimental import structref
from numba.extending import register_jitable

from wbc_suite.kernel_cache import PACKAGE, cache_folder
from wbc_suite.typing import Records

log = logging.getLogger(__name__)

_untyped: Any = numba
_numba, _njit = _untyped.config, _untyped.njit
_structref: Any = structref

Function = TypeVar("Function", bound=Callable[..., Any])
Fields = TypeVar("Fields", bound=tuple[Any, ...])

PATIENCE = 1.5  # s; what compiles for longer is announced
INTERVAL = 5.0  # s between two messages about the progress of compiling
PROGRESS = "Compiling kernels, once on this machine: %d so far, in %.0f s"

_KERNELS: list[Any] = []
"""All kernels of imported modules."""


def compiled(function: Function, *, kept: bool = True, **options: Any) -> Function:
    """Compile a function on its first call, and keep its machine code on disk.

    The function also runs as plain Python: see `plain`, or everything under
    `NUMBA_DISABLE_JIT=1`. Division by zero gives infinity or NaN, as in NumPy.

    Args:
        function: Takes numbers, arrays, tuples, and what `as_argument` returns.
        kept: Whether the machine code is kept on disk; not where an argument is a
            kernel that is made at run time, whose type no other process knows.
        options: Of numba: `nogil` releases the interpreter's lock, for long calls only
            (a thread needs up to 50 us to get it back); `inline` writes a kernel into
            its callers: for large ones with one caller, since numba's search for calls
            begins again after each.
    """
    kernel = _in_cache(partial(_njit, cache=kept, **_OPTIONS, **options), function)
    if not _numba.DISABLE_JIT:
        _KERNELS.append(kernel)
    return cast("Function", kernel)


compiled_nogil = partial(compiled, nogil=True)
compiled_inline = partial(compiled, inline="always")

_OPTIONS: dict[str, Any] = {"error_model": "numpy"}


def inner(function: Function) -> Function:
    """Let kernels call a function, which is compiled with them.

    It has no entry for Python, which costs as much to compile as ten lines, and no
    machine code of its own on disk. Python calls it as plain Python.
    """
    _INNER.append(function)
    return cast("Function", register_jitable(**_OPTIONS)(function))


_INNER: list[Any] = []
"""Functions that kernels call."""


def by_address(kernel: Any, *arguments: Any) -> Any:
    """Return a kernel as a value, for a field of a `struct`.

    A kernel that calls another one by its name holds a copy of that one, which is
    optimised and emitted again. One that finds it in a field holds only a call, which
    costs 5 ns, and the field decides which kernel it is: what a robot does not use is
    not compiled.

    Args:
        kernel: A function of `compiled` or `inner`; its result is annotated as None,
            bool, int or float, or it returns nothing.
        arguments: What it is called with, or values of the same types.
    """
    if _numba.DISABLE_JIT:
        return kernel
    function = getattr(kernel, "py_func", kernel)
    return _entry(function, tuple(map(_untyped.typeof, arguments)))


@cache
def _entry(function: Any, arguments: Any) -> Any:
    """Return the machine code of a kernel, which lives as long as the process."""
    result = function.__annotations__.get("return")
    result = _RESULTS[getattr(result, "__name__", str(result))]
    is_kept = Path(function.__code__.co_filename).is_file()
    make = _untyped.cfunc(result(*arguments), cache=is_kept, error_model="numpy")
    return _in_cache(make, function)


class Callback(types.WrapperAddressProtocol):
    """A Python function without arguments, as a value that kernels call.

    It runs with the interpreter's lock, whether or not its caller has it, and has to
    live as long as the `struct`. Kernels get whether it returned; what it raised is
    `error`.
    """

    error: Exception | None = None

    def __init__(self, function: Callable[[], None]) -> None:
        self._function = function
        self._entry = ctypes.CFUNCTYPE(ctypes.c_bool)(self)

    def __call__(self) -> bool:
        """Call the function; return whether it returned."""
        self.error = None
        try:
            self._function()
        except Exception as error:  # noqa: BLE001, no exception passes machine code
            self.error = error
        return self.error is None

    def __wrapper_address__(self) -> int:
        """Return the address of the machine code."""
        return ctypes.cast(self._entry, ctypes.c_void_p).value or 0

    def signature(self) -> Any:
        """Return numba's signature."""
        return types.boolean()


_RESULTS: dict[str, Any] = {
    "None": types.void,
    "bool": types.boolean,
    "int": types.int64,
    "float": types.float64,
}


def _in_cache(make: Any, function: Any) -> Any:
    """Let numba make a kernel whose machine code is kept in the package's folder."""
    previous = _numba.CACHE_DIR, _numba.CACHE_LOCATOR_CLASSES
    _numba.CACHE_DIR = str(cache_folder())
    if Path(function.__code__.co_filename).is_relative_to(PACKAGE):
        _numba.CACHE_LOCATOR_CLASSES = "wbc_suite.kernel_cache.PackageLocator"
    try:
        return make(function)
    finally:
        _numba.CACHE_DIR, _numba.CACHE_LOCATOR_CLASSES = previous


def is_compiling() -> bool:
    """Return whether numba compiles kernels: not under `NUMBA_DISABLE_JIT=1`."""
    return not _numba.DISABLE_JIT


def external(function: Any, signature: Any) -> Any:
    """Return a C function of a loaded library for kernels.

    In plain Python it is `function`, which has its name.
    """
    symbol = types.ExternalFunction(function.__name__, signature)
    _EXTERNAL.append((symbol, function))
    return symbol


_EXTERNAL: list[tuple[Any, Any]] = []
"""C functions that kernels call, with their Python forms."""


def plain(kernel: Any) -> Any:
    """Return a kernel, and all functions that it calls, as plain Python functions."""
    function = getattr(kernel, "py_func", None) or inspect.unwrap(kernel)
    names = dict(function.__globals__)
    for name in set(function.__code__.co_names) & set(names):
        called = names[name]
        if any(called is kernel for kernel in (*_KERNELS, *_INNER)):
            names[name] = plain(called)
        for symbol, form in _EXTERNAL:
            if called is symbol:
                names[name] = form
    return FunctionType(function.__code__, names, function.__name__)


def record_type(*fields: tuple[Any, ...]) -> np.dtype[Any]:
    """Return a type of records, 8 bytes a number, that kernels and Python read alike.

    Args:
        fields: Name, "f8" or "i8", and a shape where it is an array.
    """
    return np.dtype((np.record, list(fields)))


class Record:
    """A `record_type` whose fields type checkers know: an object stands for one record.

    A subclass declares them, of type int, float or `Annotated[Vector, size]`, each with
    its unit in the line below.

    Attributes:
        dtype: The type of its arrays.
    """

    dtype: ClassVar[np.dtype[np.void]]

    def __init_subclass__(cls) -> None:
        hints = get_type_hints(cls, include_extras=True)
        hints.pop("dtype")
        cls.dtype = record_type(
            *((name, *_field_type(hint)) for name, hint in hints.items())
        )

    @classmethod
    def zeros(cls, count: int = 1) -> Records:
        """Return records that are all zero, shape (count,)."""
        return np.zeros(count, cls.dtype)


def _field_type(hint: Any) -> tuple[Any, ...]:
    return {int: ("i8",), float: ("f8",)}.get(hint) or ("f8", get_args(hint)[1:])


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

    Arrays are shared, numbers are copied; fields that are such tuples, or plain tuples
    of them, are converted too. Without compilation it is the tuple itself.
    """
    kind: Any = type(values)
    pack: Any = getattr(kind, "pack", None)
    if _numba.DISABLE_JIT or not (pack or kind is tuple):
        return values
    fields: Any = tuple(map(as_argument, values))
    if not pack:
        return fields
    with warnings.catch_warnings():  # a tuple of functions is new in numba
        warnings.simplefilter("ignore", errors.NumbaExperimentalFeatureWarning)
        return pack(kind(*fields))


class _StructType(types.StructRef):
    """A record whose fields have the types of the arrays that it was made of."""

    def preprocess_fields(self, fields: Any) -> Any:
        """Return the fields with types of numbers in place of those of constants."""
        return tuple((name, types.unliteral(kind)) for name, kind in fields)


class _Progress(event.Listener):
    """Log how many kernels were compiled in which time, while that goes on.

    Machine code from the disk raises no event. Python looks for no reference cycles
    meanwhile: that takes a sixth of the time, for numba makes millions of objects.
    """

    count = depth = 0
    start = spent = said = 0.0  # s of wall time
    collects = True  # whether Python's garbage collector was on before

    def on_start(self, event: Any) -> None:
        """Note when the first of nested kernels begins."""
        if self.depth == 0:
            self.start, self.collects = time.monotonic(), gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event: Any) -> None:
        """Count a kernel, and say so from time to time."""
        self.count += 1
        seconds = self.seconds()
        if seconds > max(PATIENCE, self.said + INTERVAL):
            self.said = seconds
            log.warning(self.text())
        self.depth -= 1
        if self.depth == 0:
            self.spent = seconds
            if self.collects:
                gc.enable()

    def seconds(self) -> float:
        """Return the wall time in which kernels were compiled, s."""
        now = time.monotonic() - self.start if self.depth else 0.0
        return self.spent + now

    def text(self) -> str:
        """Return what is logged; nothing before the first kernel."""
        return PROGRESS % (self.count, self.seconds()) if self.count else ""


_PROGRESS = _Progress()
event.register("numba:compile", _PROGRESS)


def progress_text() -> str:
    """Return how many kernels this process has compiled; nothing if it is none."""
    return _PROGRESS.text()
