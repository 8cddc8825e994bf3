"""What the parts of a stack have in common: tasks, limits and equalities as kernels.

A part is rows of numbers that depend on the configuration: errors and Jacobian of a
task, `G dq <= h` of a limit, `A dq = b` of an equality. A kernel writes them,

    kernel(robot, own, dt, rows, values)

where `robot` is a `kinematics.RobotArrays` with current joint poses, `own` the numbers
of the part, `dt` the time of the step, s, `rows` of shape (dim, nv) and `values` of
shape (dim,). All kernels have this signature, whosever they are, and ticks call them by
their addresses. `own` is float64, and whatever a kernel takes it for: `own.view(X)`
with a `record_type` X gives it fields.
"""

import logging
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from itertools import pairwise
from typing import Any
from weakref import ref

import numpy as np

from wbc_suite import logs
from wbc_suite.compiling import by_address, compiled, inner, record_type
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics.forward import (
    RobotArrays,
    compute_joint_poses,
    multiply_poses,
)
from wbc_suite.typing import Matrix, Records, Vector

LOG = logs.logger(__name__)

MOST_KERNELS = 12
"""Kinds of kernels in one stack: so many addresses have the same type."""
MOST_LIMITS = 8
"""Limits with a kernel in one stack."""
MAX_LEVELS = 6
"""Strict levels of one stack; so many tuples have, whether or not they are used."""


PART = record_type(
    ("kernel", "i8"),  # place in `task_rows.PartArrays.kernels`; 0 does nothing
    ("own", "i8"),  # place in its `own`
    ("first", "i8"),  # its numbers are own[first:last]
    ("last", "i8"),
    ("row", "i8"),  # its rows, of limits before those of equalities
    ("end", "i8"),
    ("relax_speed", "f8"),  # `RowLimit.relax_speed`; NaN of equalities
)
"""A limit or an equality of a stack."""

STATE = record_type(
    ("residual", "f8"),  # output: greatest violation of the first level's rows
    ("all_finite", "f8"),  # output: 1 if the errors of all tasks are finite, else 0
    ("overshoot_damping", "f8"),  # [cost]^2/rad^2, see `tick.damp_overshoot`
    ("pressure_damping", "f8"),  # the same by rows that tasks press against
    ("at_rest", "f8"),  # s since a target moved
    ("solved", "i8"),  # output: number of solved levels
    ("prepared", "i8"),  # 1 where Python has evaluated what has no kernel
    ("alone", "i8"),  # 1 where all parts have one
    ("taken", "i8"),  # how the last level was solved, see `tick.Taken`
    ("levels", "i8"),  # number of strict levels
    ("warm", "i8"),  # 1 where the active set of the last tick is tried
    ("damping", "f8"),  # Tikhonov term, [cost]^2/rad^2
    ("curvature", "f8"),  # factor of damping by errors, see `task_rows.write_tasks`
)
"""Numbers of a tick."""


@inner
def nothing(
    robot: RobotArrays, own: Vector, dt: float, rows: Matrix, values: Vector
) -> None:
    """Leave rows and values as they are: constant ones, or those of Python."""


def joined(*sections: tuple[np.dtype[Any], int]) -> tuple[Vector, list[Records]]:
    """Return zeros with room for some records of each type, and views of these.

    Args:
        sections: Type of records and their number, in the order of the numbers.
    """
    ends = np.cumsum([0, *(kind.itemsize // 8 * n for kind, n in sections)])
    own: Vector = np.zeros(int(ends[-1]))
    views = [
        own[first:last].view(kind)
        for (kind, _), (first, last) in zip(sections, pairwise(ends), strict=True)
    ]
    return own, views


class SharedRow:
    """A target or costs, with a copy in every stack that holds the task.

    Attributes:
        values: The values, zero until they are `set`.
        is_set: Whether they are.
    """

    def __init__(self, size: int) -> None:
        self.values: Vector = np.zeros(size)
        self.is_set = False
        self._copies: list[ref[Vector]] = []

    def set(self, values: Vector) -> None:
        """Set the values, and those of all copies."""
        self.values[:] = values
        self.is_set = True
        for copy in self._copies:
            row = copy()
            if row is not None:
                row[:] = values

    def attach(self, copy: Vector) -> None:
        """Keep an array equal to the values as long as it exists."""
        copy[:] = self.values
        self._copies = [other for other in self._copies if other() is not None]
        self._copies.append(ref(copy))


class Numbers:
    """Numbers of tasks and equalities, one after another, as kernels read them.

    Attributes:
        values: All of them; targets and costs follow those of their parts.
    """

    def __init__(self, parts: Sequence[Any], owns: Sequence[Vector]) -> None:
        sizes = [0, *(len(own) for own in owns)]
        self._ends = np.cumsum(sizes, dtype=np.int64)
        self._index = {id(part): k for k, part in enumerate(parts)}
        self.values: Vector = np.concatenate([np.zeros(0), *owns])
        self._targets: list[Vector] = []  # copies live as long as these views
        for part in parts:
            target, (_, last) = part.target_row, self.of(part)
            if target.values.size:
                self._targets.append(self.values[last - target.values.size : last])
                target.attach(self._targets[-1])

    def of(self, part: object) -> tuple[int, int]:
        """Return the first number of a part, and the end."""
        k = self._index[id(part)]
        return int(self._ends[k]), int(self._ends[k + 1])


class Kernels:
    """The kernels of a stack, by their addresses."""

    def __init__(self) -> None:
        self._found: list[Any] = [nothing]

    def place(self, kernel: Any) -> tuple[int, bool]:
        """Return the place of a kernel, and if it has one; None has not."""
        if kernel is None:
            return 0, False
        if kernel not in self._found and len(self._found) < MOST_KERNELS:
            self._found.append(kernel)
        has_room = kernel in self._found
        return (self._found.index(kernel) if has_room else 0), has_room

    def addresses(self, robot: RobotArrays) -> tuple[Callable[..., None], ...]:
        """Return the addresses of all, as many as there are places."""
        all_of = [*self._found, *[nothing] * (MOST_KERNELS - len(self._found))]
        return tuple(address(kernel, robot) for kernel in all_of)


def address(kernel: Any, robot: RobotArrays) -> Any:
    """Return a part's kernel as a value."""
    return by_address(kernel, robot, np.zeros(1), 0.0, np.zeros((1, 1)), np.zeros(1))


def run_kernel(
    part: object,
    robot: RobotArrays,
    own: Vector,
    dt: float,
    rows: Matrix,
    values: Vector,
) -> None:
    """Let the kernel of a part write its rows, as in a tick."""
    kernel = getattr(type(part), "kernel", None)
    if kernel is None:
        raise ConfigError(
            f"{type(part).__name__} has no kernel: write its `evaluate` or `rows`."
        )
    compute_joint_poses(robot)
    _call(address(kernel, robot), robot, own, dt, rows, values)


@compiled
def _call(
    kernel: Any,
    robot: RobotArrays,
    own: Vector,
    dt: float,
    rows: Matrix,
    values: Vector,
) -> None:
    kernel(robot, own, dt, rows, values)


def kernel_of(part: object) -> Any:
    """Return the kernel that computes a task, a limit or an equality, or None.

    A subclass inherits it, unless it overrides the method that the kernel stands for,
    `evaluate` of tasks and `rows` of limits and equalities. One that overrides it by
    an equal one declares `kernel` in its own body.
    """
    for kind in type(part).__mro__:
        if "kernel" in vars(kind):
            return getattr(kind, "kernel", None)
        if "evaluate" in vars(kind) or "rows" in vars(kind):
            return None
    return None


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


@inner
def place_point(T: Vector, s: Vector, out: Vector) -> None:
    """Write a point s of a joint in world axes, m; T is the joint's pose."""
    for i in range(3):
        out[i] = T[9 + i] + T[i] * s[0] + T[3 + i] * s[1] + T[6 + i] * s[2]


@inner
def place_frame(robot: RobotArrays, joint: int, offset: Vector, out: Vector) -> None:
    """Write the pose of a frame, [R p] by columns, of its pose in a joint."""
    local = np.empty(12)
    for i in range(12):
        local[i] = offset[i]
    multiply_poses(robot.pose[joint], local, out)
