"""Bring a frame to a pose in the world."""

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_array
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.lie import is_usable, saturate
from wbc_suite.qp.rows import PACKED_FRAME
from wbc_suite.qp.task import RowTask, check_speed, cost_vector
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["FrameTask", "homogeneous"]


class FrameTask(RowTask):
    """Bring a frame to a target pose T_wt.

    Position and orientation are separate errors, so that a target far away is
    approached on a straight line whatever the rotation:

        e_p = p_wt - p_wf                 m, world axes
        e_r = log3(R_wf^T R_wt)           rad, axes of the frame
        J_p = J_aligned[:3]
        J_r = Jl^-1(e_r) J_local[3:]      Jl^-1: inverse left Jacobian of SO(3)

    Each wanted step `gain e` is shortened to `max_linear_speed dt` and
    `max_angular_speed dt`. A target that is not finite holds the frame where it is.

    Args:
        frame: Name of the frame.
        position_cost: [cost]/m, one number or one per world axis.
        orientation_cost: [cost]/rad, one number or one per axis of the frame.
        target: Target pose; without one the pose at binding time is held.
        gain: See `Task`.
        level: See `Task`.
        max_linear_speed: Greatest speed asked for, m/s.
        max_angular_speed: Greatest angular speed asked for, rad/s.
        name: How reports call the task; the frame's name when absent.

    Source: Lynch and Park (2017), "Modern Robotics", section 6.3; SO(3) Jacobian from
    Chirikjian (2012), "Stochastic Models, Information Theory, and Lie Groups", 10.86.
    """

    dim = 6

    def __init__(
        self,
        frame: str,
        *,
        position_cost: float | Vector = 1.0,
        orientation_cost: float | Vector = 1.0,
        target: pin.SE3 | Matrix | None = None,
        gain: float = 1.0,
        level: int = 0,
        max_linear_speed: float = 1.0,
        max_angular_speed: float = 3.0,
        name: str | None = None,
    ) -> None:
        super().__init__(name or frame, gain=gain, level=level)
        self.frame = frame
        self.packed: Vector = np.zeros(PACKED_FRAME)
        self._pose: Matrix = self.packed[:12].reshape(3, 4)
        self.packed[18] = self.gain
        self.packed[19] = check_speed(self.name, max_linear_speed)
        self.packed[20] = check_speed(self.name, max_angular_speed)
        self.packed[12:15] = cost_vector(self.name, position_cost, 3)
        self.packed[15:18] = cost_vector(self.name, orientation_cost, 3)
        self.has_target = target is not None
        if target is not None:
            self.set_target(target)

    def set_costs(
        self,
        *,
        position: float | Vector | None = None,
        orientation: float | Vector | None = None,
    ) -> None:
        """Change the costs, [cost]/m and [cost]/rad."""
        if position is not None:
            self.packed[12:15] = cost_vector(self.name, position, 3)
        if orientation is not None:
            self.packed[15:18] = cost_vector(self.name, orientation, 3)

    def set_target(self, target: pin.SE3 | Matrix) -> None:
        """Set the target pose T_wt: an SE3 or a homogeneous matrix, shape (4, 4).

        Values that are not finite are accepted: the tick then holds the frame and
        reports it.

        Raises:
            ConfigError: If the shape is wrong or the rotation is no rotation.
        """
        self._pose[:] = homogeneous(self.name, target)[:3]
        self.has_target = True

    @property
    def target(self) -> pin.SE3:
        """Target pose T_wt, a copy."""
        return pin.SE3(self._pose[:, :3].copy(), self._pose[:, 3].copy())

    def bind(self, configuration: Configuration) -> None:
        """Resolve the frame; without a target, hold its present pose."""
        self.frame_index = configuration.frame_id(self.frame)
        if not self.has_target:
            self.set_target(configuration.frame_pose(self.frame_index))

    def support(self, configuration: Configuration) -> Indices:
        """Return the velocity indices between the root and the frame."""
        return configuration.support(self.frame)

    def rows(
        self, configuration: Configuration, dt: float, W: Matrix, e: Vector
    ) -> Vector:
        """Write the rows; the readable form of the kernel `frame_rows`."""
        error = self.error(configuration)
        held = not np.isfinite(error).all()
        step = np.zeros(6) if held else error
        J = self.jacobian(configuration, step[3:])
        step = step * self.gain
        saturate(step[:3], self.packed[19] * dt)
        saturate(step[3:], self.packed[20] * dt)
        costs = self.packed[12:18]
        W[:] = costs[:, None] * J
        e[:] = costs * step
        return error

    def error(self, configuration: Configuration) -> Vector:
        """Return (e_p, e_r), m and rad, shape (6,)."""
        if not is_usable(self.packed[:12]):
            return np.full(6, np.nan)
        pose, error = configuration.frame_pose(self.frame_index), np.empty(6)
        np.subtract(self._pose[:, 3], pose.translation, out=error[:3])
        error[3:] = pin.log3(pose.rotation.T @ self._pose[:, :3])
        return error

    def jacobian(
        self, configuration: Configuration, rotation_error: Vector | None = None
    ) -> Matrix:
        """Return the derivative J of the error, `d(e) = -J dq`, shape (6, nv)."""
        if rotation_error is None:
            rotation_error = self.error(configuration)[3:]
        J = configuration.frame_jacobian(self.frame_index, "aligned")
        R = configuration.frame_pose(self.frame_index).rotation
        # Jlog3 is the inverse right Jacobian; Jl^-1(r) = Jr^-1(-r).
        J[3:] = pin.Jlog3(pin.exp3(-rotation_error)) @ R.T @ J[3:]
        return J


def homogeneous(owner: str, pose: pin.SE3 | Matrix) -> Matrix:
    """Return a pose given in either form as a matrix, shape (4, 4).

    Raises:
        ConfigError: If the shape is wrong, or a finite rotation is not orthonormal.
    """
    if isinstance(pose, pin.SE3):
        return pose.homogeneous
    matrix = check_array(f"{owner}: the pose, an SE3 or a matrix,", pose, (4, 4))
    rotation = matrix[:3, :3]
    if np.isfinite(rotation).all() and (
        np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-6
        or np.linalg.det(rotation) < 0.0
    ):
        raise ConfigError(f"{owner}: the upper left 3 x 3 block is not a rotation.")
    return matrix
