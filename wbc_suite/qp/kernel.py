"""Which parts of a stack are computed by compiled kernels."""

import logging
from collections.abc import Iterable
from enum import IntEnum
from functools import cache

from wbc_suite import logs

LOG = logs.logger(__name__)


class Kernel(IntEnum):
    """What computes a task, a limit or an equality in each tick."""

    PYTHON = 0  # its own method, before the tick
    CONSTANT = 1  # its own method, once
    FRAME = 2
    COM = 3
    POSTURE = 4
    SELF_COLLISION = 5
    FLOOR = 6
    OBSTACLE = 7


def kernel_of(part: object) -> Kernel:
    """Return the kernel that computes a task, a limit or an equality.

    A subclass inherits it, unless it overrides the method that the kernel stands for,
    `evaluate` of tasks and `rows` of limits and equalities. One that overrides it by
    an equal one declares `kernel` in its own body.
    """
    kind = type(part)
    owner = next((c for c in kind.__mro__ if "kernel" in vars(c)), kind)
    for method in ("evaluate", "rows"):
        if getattr(kind, method, None) is not getattr(owner, method, None):
            return Kernel.PYTHON
    return getattr(kind, "kernel", Kernel.PYTHON)


def log_python_parts(parts: Iterable[object]) -> None:
    """Log, once for each, the parts of a stack that have no kernel."""
    for part in parts:
        _log_python_part(type(part), str(getattr(part, "name", "")))


@cache
def _log_python_part(kind: type, name: str) -> None:
    """Log a part without a kernel: a warning, unless the class is of this package."""
    ours = kind.__module__.startswith(f"{__package__}.")
    LOG.log(
        logging.INFO if ours else logging.WARNING,
        "TaskStack: %s%s has no compiled kernel, so each tick calls its Python method.",
        kind.__name__,
        f" '{name}'" if name else "",
    )
