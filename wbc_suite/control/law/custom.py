"""Registered laws of users."""

from typing import Any

from wbc_suite.control.loop.records import LawKind

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


def law_kernel(kind: int) -> Any:
    """Return the kernel of a registered law."""
    return _KERNELS[kind - int(LawKind.CUSTOM)]
