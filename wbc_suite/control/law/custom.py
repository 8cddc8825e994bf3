"""Registered laws of users."""

from functools import cache
from typing import Any

import numba
import numpy as np

from wbc_suite.control.loop.acceleration_limits import limit_accelerations
from wbc_suite.control.loop.records import CompiledRecords, LawKind
from wbc_suite.typing import Indices

_KERNELS: list[Any] = []
"""Registered kernels; the kind of a law is `LawKind.CUSTOM` plus its place here."""


def register_law(kernel: Any) -> int:
    """Add a law to the control loop; return its kind for `Law`.

    Args:
        kernel: A function `(physics, law, drives) -> None` of `wbc_suite.compiling.
            compiled`. It writes the accelerations of the law's joints,
            `drives[law.first : law.last]`, to `physics.acceleration[drive.dof]`. The
            loop then applies the limits of the joints and computes the torques.
            Registering a kernel again returns the same kind.
    """
    if kernel not in _KERNELS:
        _KERNELS.append(kernel)
    return int(LawKind.CUSTOM) + _KERNELS.index(kernel)


def custom_kernel(kinds: Indices) -> Any:
    """Return one kernel for all registered laws among these kinds, None without any."""
    return _chain(tuple(np.unique(kinds[kinds >= int(LawKind.CUSTOM)]).tolist()))


@cache
def _chain(kinds: tuple[int, ...]) -> Any:
    """Return one kernel for laws of these kinds; it lives on, as its machine code."""
    run: Any = _no_law if kinds else None
    for kind in kinds:
        run = _linked(kind, _KERNELS[kind - int(LawKind.CUSTOM)], run)
    return run


@numba.njit
def _no_law(physics: Any, law: CompiledRecords, drives: CompiledRecords) -> None:
    """Do nothing: the law is of no registered kind."""


def _linked(kind: int, kernel: Any, others: Any) -> Any:
    """Return a kernel that computes laws of one kind, and others by another kernel."""

    @numba.njit
    def run(physics: Any, law: CompiledRecords, drives: CompiledRecords) -> None:
        if law.kind == kind:
            kernel(physics, law, drives)
            limit_accelerations(physics, law, drives)
        else:
            others(physics, law, drives)

    return run
