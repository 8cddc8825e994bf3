"""First machine code on another processor: what is needed later is compiled beside.

Numba compiles one function at a time in a process. A second process puts code where the
first one finds it when it is needed: in the cache on disk.
"""

import inspect
import os
import subprocess
import sys
from collections.abc import Callable, Iterable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, cast

from numba import types

from wbc_suite.typing import Indices

__all__ = ["compile_ahead"]

_TYPES: tuple[tuple[Any, Any], ...] = (
    (bool, types.boolean),
    (int, types.int64),
    (float, types.float64),
    (Indices, types.int64[:, ::1]),
)
"""How numba calls what we annotate; integers are an `ArrayTable`'s."""

_ASKED: set[str] = set()
"""What another process was asked for: one is enough for many controllers."""


def compile_ahead(*functions: Callable[..., Any]) -> None:
    """Have functions compiled by another process, where there is no code of them.

    Who calls one of them meanwhile waits for it. Does nothing with one processor.

    Args:
        functions: Of `compiled`, with annotations that `build` knows.
    """
    wanted = {
        name: function
        for function in functions
        if (name := f"{function.__module__}:{function.__name__}") not in _ASKED
        and not _has_code(function)
    }
    if not wanted or os.cpu_count() == 1:
        return
    _ASKED.update(wanted)
    call = f"from {__name__} import build; build(*{tuple(wanted)!r})"
    process = subprocess.Popen(
        [sys.executable, "-c", call],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    for entry in cast("Iterable[Any]", wanted.values()):
        entry.compile = partial(_compile_after, process, entry.compile)


def build(*names: str) -> None:
    """Compile functions for arguments as they are annotated.

    Args:
        names: Like `package.module:function`.
    """
    for name in names:
        module, _, function = name.partition(":")
        entry = getattr(import_module(module), function)
        entry.compile(_signature(entry.py_func))


def _signature(function: Callable[..., Any]) -> tuple[Any, ...]:
    """Return numba's types of a function's arguments."""
    annotations = [
        parameter.annotation
        for parameter in inspect.signature(function).parameters.values()
    ]
    return tuple(
        next(known for ours, known in _TYPES if ours == annotation)
        for annotation in annotations
    )


def _has_code(function: Any) -> bool:
    """Tell whether a function has machine code here or on disk."""
    if function.signatures:
        return True
    folder = Path(function.stats.cache_path)
    return any(folder.glob(f"*.{function.__name__}-*.nbi"))


def _compile_after(
    process: "subprocess.Popen[bytes]",
    compile_for: Callable[[Any], Any],
    signature: Any,
) -> Any:
    """Wait for the other process, and read its code; compile where it has none."""
    process.wait()
    return compile_for(signature)
