"""Registered laws of users."""

from functools import cache
from typing import Any

import numba
import numpy as np

from wbc_suite.control.loop.acceleration_limits import limit_accelerations
from wbc_suite.control.loop.records import CompiledRecords, LawKind
from wbc_suite.registry import Registry
from wbc_suite.typing import Indices

LAWS: Registry[Any] = Registry("law")
"""Kernels `(physics, law, drives) -> None` of `wbc_suite.compiling.compiled`, by name.

A kernel writes the accelerations of the law's joints, `drives[law.first : law.last]`,
to `physics.acceleration[drive.dof]`. The loop then applies the limits of the joints and
computes the torques.
"""

register_law = LAWS.register


def law_kind(name: str) -> int:
    """Return the number of a registered law in records; raises UnknownNameError."""
    return int(LawKind.CUSTOM) + list(LAWS).index(LAWS.spelled(name))


def custom_kernel(kinds: Indices) -> Any:
    """Return one kernel for all registered laws among these kinds, None without any."""
    known = {law_kind(name): LAWS[name] for name in LAWS}
    own = np.unique(kinds[kinds >= int(LawKind.CUSTOM)]).tolist()
    return _chain(tuple((kind, known[kind]) for kind in own))


@cache
def _chain(kernels: tuple[tuple[int, Any], ...]) -> Any:
    """Return one kernel for laws by kind; it lives on, as its machine code."""
    run: Any = _no_law if kernels else None
    for kind, kernel in kernels:
        run = _linked(kind, kernel, run)
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
