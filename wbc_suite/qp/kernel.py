"""Which parts of a stack are computed by compiled kernels."""

from enum import IntEnum


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
    """Return the kernel that the class of a part declares in its own body.

    Subclasses do not inherit it: what they compute may be another. One that computes
    the same declares the same.
    """
    return vars(type(part)).get("kernel", Kernel.PYTHON)
