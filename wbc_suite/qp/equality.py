"""Rows that a solution keeps exactly: feet that must not move, wheels that roll."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Literal

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_array, check_number
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.frame_task import homogeneous
from wbc_suite.qp.lie import is_usable, saturate
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["Equality", "FrameEquality", "LinearEquality"]

Direction = Literal["x", "y", "z", "roll", "pitch", "yaw"]
_DIRECTIONS = ("x", "y", "z", "roll", "pitch", "yaw")


class Equality(ABC):
    """Rows `A dq = b`, prior to every task.

    Attributes:
        name: How reports call the rows.
        dim: Number of rows.
    """

    name: str
    dim: int

    @abstractmethod
    def bind(self, configuration: Configuration) -> None:
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
        frame: Name of the frame.
        directions: Which local directions are held, of x y z roll pitch yaw.
        hold_pose: Whether drift is led back.
        target: Pose T_wt to hold; the pose at binding time when absent.
        gain: Fraction of the drift that one step removes, (0, 1].
        name: How reports call it; the frame's name when absent.

    Raises:
        ConfigError: If the gain is out of range.
        UnknownNameError: If a direction is unknown.
    """

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
        self._kept: Indices = np.array(kept, dtype=np.int64)
        self.dim = len(self._kept)
        self.target: pin.SE3 | None = None
        if target is not None:
            self.set_target(target)

    def set_target(self, target: pin.SE3 | Matrix) -> None:
        """Set the pose T_wt to hold."""
        T = homogeneous(self.name, target)
        self.target = pin.SE3(T[:3, :3].copy(), T[:3, 3].copy())

    def bind(self, configuration: Configuration) -> None:
        """Resolve the frame; without a target, hold its present pose."""
        self.frame_index = configuration.frame_id(self.frame)
        if self.target is None:
            self.target = configuration.frame_pose(self.frame_index)

    def rows(
        self, configuration: Configuration, dt: float, A: Matrix, b: Vector
    ) -> None:
        """Write the kept rows of `J_local dq = gain e`."""
        A[:] = configuration.frame_jacobian(self.frame_index)[self._kept]
        if not self.hold_pose:
            b[:] = 0.0
            return
        error = self.error(configuration)
        error *= self.gain
        if not np.isfinite(error).all():
            error[:] = 0.0
        saturate(error[:3], 0.5 * dt)
        saturate(error[3:], 1.0 * dt)
        b[:] = error[self._kept]

    def error(self, configuration: Configuration) -> Vector:
        """Return the drift e, m and rad in the frame's axes, shape (6,)."""
        assert self.target is not None
        if not is_usable(self.target.homogeneous):
            return np.full(6, np.nan)
        pose = configuration.frame_pose(self.frame_index)
        drift = pose.actInv(self.target)
        return np.concatenate([drift.translation, pin.log3(drift.rotation)])


class LinearEquality(Equality):
    """Constant rows `matrix dq = rate dt`.

    Args:
        matrix: Rows, shape (dim, nv).
        rate: Right-hand side per second, shape (dim,); zero when absent.
        name: How reports call the rows.

    Raises:
        ConfigError: If shapes differ or a value is not finite.
    """

    def __init__(
        self, matrix: Matrix, *, rate: Vector | None = None, name: str = "equality"
    ) -> None:
        self.name = name
        owner = f"LinearEquality '{name}'"
        self.matrix: Matrix = np.atleast_2d(
            check_array(f"{owner}: the matrix", matrix, None).copy()
        )
        if self.matrix.ndim != 2:
            raise ConfigError(f"{owner}: a matrix, not shape {self.matrix.shape}.")
        self.dim = len(self.matrix)
        self.rate: Vector = np.zeros(self.dim)
        if rate is not None:
            self.rate[:] = check_array(f"{owner}: the rate", rate, (self.dim,))
        if not (np.isfinite(self.matrix).all() and np.isfinite(self.rate).all()):
            raise ConfigError(f"LinearEquality '{name}': a value is not finite.")

    def bind(self, configuration: Configuration) -> None:
        """Check the number of columns.

        Raises:
            ConfigError: If it differs from nv.
        """
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
