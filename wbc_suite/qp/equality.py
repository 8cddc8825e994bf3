"""Rows that a solution keeps exactly: feet that must not move, wheels that roll."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar, Literal, NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_array, check_number
from wbc_suite.compiling import as_argument, compiled, struct
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import (
    RobotArrays,
    compute_joint_poses,
    multiply_poses,
    pack_pose,
)
from wbc_suite.qp.frame_task import homogeneous
from wbc_suite.qp.kernel import Kernel
from wbc_suite.qp.lie import log3, saturate
from wbc_suite.qp.task import SharedRow
from wbc_suite.qp.task_kernels import relative_rotation
from wbc_suite.typing import Indices, Matrix, Vector

Direction = Literal["x", "y", "z", "roll", "pitch", "yaw"]
_DIRECTIONS = ("x", "y", "z", "roll", "pitch", "yaw")
_RETURN_SPEED = 0.5  # m/s, of a frame that has drifted
_RETURN_ANGULAR_SPEED = 1.0  # rad/s


class Equality(ABC):
    """Rows `A dq = b`, prior to every task: `dim` of them, which reports call `name`.

    What writes them is inherited with `rows`, see `kernel_of`.
    """

    kernel: ClassVar[Kernel] = Kernel.PYTHON
    name: str
    dim: int

    def bind(self, configuration: Configuration) -> None:  # noqa: B027, may be empty
        """Resolve names in a model."""

    @abstractmethod
    def rows(
        self, configuration: Configuration, dt: float, A: Matrix, b: Vector
    ) -> None:
        """Write A, shape (dim, nv), and b, shape (dim,)."""


class FrameEquality(Equality):
    """Hold a frame, or forbid it some directions of motion.

    With a pose to hold, drift is led back: `J_local dq = gain e`, where
    `e = (R_wf^T (p_wt - p_wf), log3(R_wf^T R_wt))`, shortened to 0.5 m/s and 1 rad/s.
    Without one, `J_local dq = 0`: a differential drive is
    `FrameEquality("base", directions=("y",), hold_pose=False)`.

    Args:
        directions: Which local directions are held, of x y z roll pitch yaw.
        hold_pose: Whether drift is led back.
        target: Pose T_wt to hold; the pose at binding time when absent.
        gain: Fraction of the drift that one step removes, (0, 1].

    Raises:
        ConfigError: If the gain is out of range.
        UnknownNameError: If a direction is unknown.
    """

    kernel: ClassVar[Kernel] = Kernel.FRAME

    def __init__(
        self,
        frame: str,
        *,
        directions: Sequence[Direction] = _DIRECTIONS,
        hold_pose: bool = True,
        target: pin.SE3 | Matrix | None = None,
        gain: float = 0.5,
        name: str | None = None,
    ) -> None:
        if not isinstance(directions, Sequence):  # type: ignore[reportUnnecessaryIsInstance]
            raise ConfigError(f"FrameEquality '{frame}': directions are a list.")
        for direction in directions:
            if direction not in _DIRECTIONS:
                raise UnknownNameError("direction", direction, _DIRECTIONS)
        what = f"FrameEquality '{frame}': gain"
        self.gain = check_number(what, gain, above=0.0, most=1.0)
        self.name, self.frame = name or frame, frame
        self.hold_pose = hold_pose
        kept = [_DIRECTIONS.index(direction) for direction in directions]
        self.directions: Indices = np.array(kept, dtype=np.int64)
        self.dim = len(kept)
        self.target_row = SharedRow(12)
        if target is not None:
            self.set_target(target)

    def set_target(self, target: pin.SE3 | Matrix) -> None:
        """Set the pose T_wt to hold."""
        self.target_row.set(homogeneous(self.name, target).ravel()[:12])

    def bind(self, configuration: Configuration) -> None:
        """Resolve the frame; without a target, hold its present pose."""
        if not self.target_row.is_set:
            self.set_target(configuration.frame_pose(self.frame))

    def rows(
        self, configuration: Configuration, dt: float, A: Matrix, b: Vector
    ) -> None:
        """Write the kept rows of `J_local dq = gain e`."""
        compute_joint_poses(configuration.robot)
        held = as_argument(HeldFrames.of(configuration, [(self, 0)]))
        hold_frames(configuration.robot, held, dt, A, b)

    def error(self, configuration: Configuration) -> Vector:
        """Return the drift e, m and rad in the frame's axes, shape (6,)."""
        compute_joint_poses(configuration.robot)
        held, error = HeldFrames.of(configuration, [(self, 0)]), np.empty(6)
        _drift(configuration.robot, as_argument(held), 0, np.empty(12), error)
        return error


class LinearEquality(Equality):
    """Constant rows `matrix dq = rate dt`.

    Args:
        matrix: Rows, shape (dim, nv).
        rate: Right-hand side per second, shape (dim,); zero when absent.

    Raises:
        ConfigError: If shapes differ or a value is not finite.
    """

    kernel: ClassVar[Kernel] = Kernel.CONSTANT

    def __init__(
        self, matrix: Matrix, *, rate: Vector | None = None, name: str = "equality"
    ) -> None:
        self.name = name
        owner = f"LinearEquality '{name}'"
        rows = check_array(f"{owner}: the matrix", matrix, None)
        self.matrix: Matrix = np.atleast_2d(rows.copy())
        if self.matrix.ndim != 2:
            raise ConfigError(f"{owner}: a matrix, not shape {self.matrix.shape}.")
        self.dim = len(self.matrix)
        self.rate: Vector = np.zeros(self.dim)
        if rate is not None:
            self.rate[:] = check_array(f"{owner}: the rate", rate, (self.dim,))
        if not (np.isfinite(self.matrix).all() and np.isfinite(self.rate).all()):
            raise ConfigError(f"{owner}: a value is not finite.")

    def bind(self, configuration: Configuration) -> None:
        """Raise ConfigError if the number of columns is not nv."""
        if self.matrix.shape[1] != configuration.nv:
            raise ConfigError(
                f"LinearEquality '{self.name}': {self.matrix.shape[1]} columns; "
                f"the model has nv {configuration.nv}."
            )

    def rows(
        self, configuration: Configuration, dt: float, A: Matrix, b: Vector
    ) -> None:
        """Write the rows."""
        A[:] = self.matrix
        np.multiply(self.rate, dt, out=b)


@struct
class HeldFrames(NamedTuple):
    """Frames that `hold_frames` holds: n of them, with m rows."""

    joint: Indices  # (n,), parent joint of each frame
    offset: Matrix  # (n, 12), pose of the frame in its joint, by columns
    moves: Matrix  # (n, nv), 1 where a velocity moves the frame, else 0
    target: Matrix  # (n, 12), pose to hold, [R p] row by row
    gain: Vector  # (n,), fraction of the drift that one step removes; 0 removes none
    directions: Indices  # (m,), local direction of each row
    row_start: Indices  # (n + 1,), first entry of each frame in `directions`, and m
    row: Indices  # (m,), row of the problem of each entry of `directions`

    @classmethod
    def of(
        cls, configuration: Configuration, held: Sequence[tuple[FrameEquality, int]]
    ) -> "HeldFrames":
        """Return the arrays of some equalities, each with its first row."""
        model, count = configuration.model, len(held)
        frames = [model.frames[configuration.frame_id(x.frame)] for x, _ in held]
        moves = np.zeros((count, configuration.nv))
        for k, frame in enumerate(frames):
            moves[k, configuration.joint_support(frame.parentJoint)] = 1.0
        none = [np.zeros(0, dtype=np.int64)]
        rows = [row + np.arange(x.dim, dtype=np.int64) for x, row in held]
        return cls(
            joint=np.array([f.parentJoint for f in frames], dtype=np.int64),
            offset=np.reshape([pack_pose(f.placement) for f in frames], (count, 12)),
            moves=moves,
            target=np.reshape([x.target_row.values for x, _ in held], (count, 12)),
            gain=np.array([x.gain if x.hold_pose else 0.0 for x, _ in held]),
            directions=np.concatenate([*none, *(x.directions for x, _ in held)]),
            row_start=np.cumsum([0, *(x.dim for x, _ in held)], dtype=np.int64),
            row=np.concatenate([*none, *rows]),
        )


@compiled
def hold_frames(
    robot: RobotArrays, held: HeldFrames, dt: float, A: Matrix, b: Vector
) -> None:
    """Write the kept rows of `J_local dq = gain e`, see `FrameEquality`.

    Joint poses are current; A and b are all equality rows of the problem.
    """
    T, error = np.empty(12), np.empty(6)
    for t in range(held.joint.shape[0]):
        _drift(robot, held, t, T, error)
        finite = True
        for i in range(6):
            error[i] *= held.gain[t]
            finite &= bool(np.isfinite(error[i]))
        saturate(error[:3], _RETURN_SPEED * dt)
        saturate(error[3:], _RETURN_ANGULAR_SPEED * dt)
        for k in range(held.row_start[t], held.row_start[t + 1]):
            row, direction = held.row[k], held.directions[k]
            b[row] = error[direction] if finite and held.gain[t] > 0.0 else 0.0
            a = T[3 * (direction % 3) : 3 * (direction % 3) + 3]
            for col in range(A.shape[1]):
                J, speed = robot.jacobian[col], 0.0
                if direction >= 3:
                    speed = a[0] * J[3] + a[1] * J[4] + a[2] * J[5]
                else:
                    speed += a[0] * (J[0] + J[4] * T[11] - J[5] * T[10])
                    speed += a[1] * (J[1] + J[5] * T[9] - J[3] * T[11])
                    speed += a[2] * (J[2] + J[3] * T[10] - J[4] * T[9])
                A[row, col] = held.moves[t, col] * speed


@compiled
def _drift(
    robot: RobotArrays, held: HeldFrames, t: int, T: Vector, error: Vector
) -> None:
    """Write the pose of a frame, and its drift in the frame's axes, shape (6,)."""
    target, E = held.target[t], np.empty((3, 3))
    multiply_poses(robot.pose[held.joint[t]], held.offset[t], T)
    finite = relative_rotation(T, target, E)
    log3(E, error[3:])
    for i in range(3):
        error[i] = 0.0
        for j in range(3):
            error[i] += T[3 * i + j] * (target[4 * j + 3] - T[9 + j])
    if not finite:
        error[:] = np.nan
