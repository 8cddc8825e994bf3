"""Rows that a solution keeps exactly: feet that must not move, wheels that roll."""

from collections.abc import Sequence
from typing import Any, ClassVar, Literal

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_array, check_number
from wbc_suite.compiling import inner, record_type
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays, pack_pose
from wbc_suite.qp.frame_task import homogeneous, relative_rotation
from wbc_suite.qp.lie import is_usable, log3, saturate
from wbc_suite.qp.part import SharedRow, place_frame, run_kernel
from wbc_suite.typing import CompiledRecords, Indices, Matrix, Vector

Direction = Literal["x", "y", "z", "roll", "pitch", "yaw"]
_DIRECTIONS = ("x", "y", "z", "roll", "pitch", "yaw")
_RETURN_SPEED = 0.5  # m/s, of a frame that has drifted
_RETURN_ANGULAR_SPEED = 1.0  # rad/s


HELD = record_type(
    ("joint", "i8"),  # parent joint of the frame
    ("offset", "f8", (12,)),  # its pose in the joint, [R p] by columns
    ("gain", "f8"),  # fraction of the drift that one step removes; 0 removes none
    ("directions", "i8", (6,)),  # local direction of each row
    ("target", "f8", (12,)),  # pose to hold, [R p] row by row
)
"""Numbers of a frame that is held."""


@inner
def hold_frame(
    robot: RobotArrays, own: Vector, dt: float, rows: Matrix, values: Vector
) -> None:
    """Write the kept rows of `J_local dq = gain e`, see `FrameEquality`."""
    T, error, held = np.empty(12), np.empty(6), own.view(HELD)[0]
    drift(robot, held, T, error)
    finite, gain = True, held.gain
    columns, joints = robot.jacobian, robot.joints
    for i in range(6):
        error[i] *= gain
        finite &= bool(np.isfinite(error[i]))
    saturate(error[:3], _RETURN_SPEED * dt)
    saturate(error[3:], _RETURN_ANGULAR_SPEED * dt)
    for row in range(values.shape[0]):
        direction, j = held.directions[row], held.joint
        values[row] = error[direction] if finite and gain > 0.0 else 0.0
        k = 3 * (direction % 3)
        x, y, z = T[k], T[k + 1], T[k + 2]
        while j > 0:
            joint = joints[j]
            for col in range(joint.v_start, joint.v_start + joint.v_count):
                J = columns[col]
                if direction >= 3:
                    speed = x * J[3] + y * J[4] + z * J[5]
                else:
                    speed = x * (J[0] + J[4] * T[11] - J[5] * T[10])
                    speed += y * (J[1] + J[5] * T[9] - J[3] * T[11])
                    speed += z * (J[2] + J[3] * T[10] - J[4] * T[9])
                rows[row, col] = speed
            j = joint.parent


@inner
def drift(robot: RobotArrays, held: CompiledRecords, T: Vector, error: Vector) -> None:
    """Write the pose of a frame, and its drift in the frame's axes, shape (6,)."""
    target, E = held.target, np.empty((3, 3))
    place_frame(robot, held.joint, held.offset, T)
    finite = relative_rotation(T, target, E)
    log3(E, error[3:])
    for i in range(3):
        error[i] = 0.0
        for j in range(3):
            error[i] += T[3 * i + j] * (target[4 * j + 3] - T[9 + j])
    if not finite:
        error[:] = np.nan


@inner
def scale_rate(
    robot: RobotArrays, own: Vector, dt: float, rows: Matrix, values: Vector
) -> None:
    """Write `b = rate dt`; own is the rate. The rows are constant."""
    for row in range(values.shape[0]):
        values[row] = own[row] * dt


class Equality:
    """Rows `A dq = b`, prior to every task: `dim` of them, which reports call `name`.

    A subclass writes `rows`, or names a `kernel` and its numbers, see `part`.
    """

    kernel: ClassVar[Any] = None
    name: str
    dim: int
    target_row: SharedRow = SharedRow(0)

    def bind(self, configuration: Configuration) -> None:
        """Resolve names in a model."""

    def own(self, configuration: Configuration) -> Vector:
        """Return the numbers that the kernel reads; they end with `target_row`."""
        return self.target_row.values.copy()

    def rows(
        self, configuration: Configuration, dt: float, A: Matrix, b: Vector
    ) -> None:
        """Write A, shape (dim, nv), and b, shape (dim,).

        A is zero before the first call.
        """
        run_kernel(self, configuration.robot, self.own(configuration), dt, A, b)


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

    kernel: ClassVar[Any] = hold_frame

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
        kept = [_DIRECTIONS.index(direction) for direction in dict.fromkeys(directions)]
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

    def own(self, configuration: Configuration) -> Vector:
        """Return a `HELD` record."""
        frame = configuration.model.frames[configuration.frame_id(self.frame)]
        held = np.zeros(1, HELD)
        held["joint"], held["offset"] = frame.parentJoint, pack_pose(frame.placement)
        held["gain"] = self.gain if self.hold_pose else 0.0
        held["directions"][0, : self.dim] = self.directions
        held["target"] = self.target_row.values
        return held.view(np.float64)

    def error(self, configuration: Configuration) -> Vector:
        """Return the drift e, m and rad in the frame's axes, shape (6,)."""
        pose = configuration.frame_pose(self.frame)
        T = self.target_row.values.reshape(3, 4)
        if not is_usable(T):
            return np.full(6, np.nan)
        R = pose.rotation.T
        turn = pin.log3(R @ T[:, :3])
        return np.concatenate([R @ (T[:, 3] - pose.translation), turn])


class LinearEquality(Equality):
    """Constant rows `matrix dq = rate dt`.

    Args:
        matrix: Rows, shape (dim, nv).
        rate: Right-hand side per second, shape (dim,); zero when absent.

    Raises:
        ConfigError: If shapes differ or a value is not finite.
    """

    kernel: ClassVar[Any] = scale_rate

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

    def own(self, configuration: Configuration) -> Vector:
        """Return the rate."""
        return self.rate.copy()
