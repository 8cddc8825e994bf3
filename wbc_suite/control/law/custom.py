"""Registered laws of users."""

from typing import Any

from wbc_suite.control.loop.records import LawKind
from wbc_suite.registry import Registry

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


def law_kernel(kind: int) -> Any:
    """Return the kernel of a registered law."""
    return LAWS[list(LAWS)[kind - int(LawKind.CUSTOM)]]
