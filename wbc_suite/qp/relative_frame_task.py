"""Bring a frame to a pose relative to another frame."""

import numpy as np
import pinocchio as pin

from wbc_suite.kinematics import Configuration
from wbc_suite.qp.frame_task import homogeneous
from wbc_suite.qp.lie import is_usable, saturate
from wbc_suite.qp.task import RowTask, check_speed, cost_vector
from wbc_suite.typing import Matrix, Vector

__all__ = ["RelativeFrameTask"]


class RelativeFrameTask(RowTask):
    """Bring a frame f to a target pose T_rt in another frame r.

        e_p = p_rt - p_rf                                      m, axes of r
        e_r = log3(R_rf^T R_rt)                                rad, axes of f
        J_p = R_wr^T (J_vf - J_vr + [p_wf - p_wr]x J_wr)       v: linear rows
        J_r = Jl^-1(e_r) R_wf^T (J_wf - J_wr)                  w: angular rows

    All Jacobians are aligned; the velocity of f as r sees it is
    `v_f - v_r - w_r x (p_wf - p_wr)`.

    Args:
        frame: Name of the frame f.
        root: Name of the frame r.
        position_cost: [cost]/m, one number or one per axis of r.
        orientation_cost: [cost]/rad, one number or one per axis of f.
        target: Pose T_rt; without one the pose at binding time is held.
        gain: See `Task`.
        level: See `Task`.
        max_linear_speed: Greatest relative speed asked for, m/s.
        max_angular_speed: Greatest relative angular speed asked for, rad/s.
        name: How reports call the task; "frame in root" when absent.
    """

    dim = 6

    def __init__(
        self,
        frame: str,
        root: str,
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
        super().__init__(name or f"{frame} in {root}", gain=gain, level=level)
        self.frame, self.root = frame, root
        self._costs = np.concatenate(
            [
                cost_vector(self.name, position_cost, 3),
                cost_vector(self.name, orientation_cost, 3),
            ]
        )
        self._speeds = (
            check_speed(self.name, max_linear_speed),
            check_speed(self.name, max_angular_speed),
        )
        self.target: pin.SE3 | None = None
        if target is not None:
            self.set_target(target)

    def set_target(self, target: pin.SE3 | Matrix) -> None:
        """Set the pose T_rt: an SE3 or a homogeneous matrix, shape (4, 4).

        Raises:
            ConfigError: If the shape is wrong or the rotation is no rotation.
        """
        T = homogeneous(self.name, target)
        self.target = pin.SE3(T[:3, :3].copy(), T[:3, 3].copy())

    def bind(self, configuration: Configuration) -> None:
        """Resolve both frames; without a target, hold the present relative pose."""
        self._f = configuration.frame_id(self.frame)
        self._r = configuration.frame_id(self.root)
        if self.target is None:
            root = configuration.frame_pose(self._r)
            self.target = root.actInv(configuration.frame_pose(self._f))

    def error(self, configuration: Configuration) -> Vector:
        """Return (e_p, e_r), m and rad, shape (6,)."""
        assert self.target is not None
        root = configuration.frame_pose(self._r)
        pose = root.actInv(configuration.frame_pose(self._f))
        if not is_usable(self.target.homogeneous):
            return np.full(6, np.nan)
        rotation = pose.rotation.T @ self.target.rotation
        return np.concatenate(
            [self.target.translation - pose.translation, pin.log3(rotation)]
        )

    def jacobian(
        self, configuration: Configuration, rotation_error: Vector | None = None
    ) -> Matrix:
        """Return the derivative J of the error, `d(e) = -J dq`, shape (6, nv)."""
        if rotation_error is None:
            rotation_error = self.error(configuration)[3:]
        root = configuration.frame_pose(self._r)
        pose = configuration.frame_pose(self._f)
        J_root = configuration.frame_jacobian(self._r, "aligned").copy()
        J = configuration.frame_jacobian(self._f, "aligned") - J_root
        arm = pose.translation - root.translation
        J[:3] += pin.skew(arm) @ J_root[3:]  # - w x arm = arm x w
        J[:3] = root.rotation.T @ J[:3]
        J[3:] = pin.Jlog3(pin.exp3(-rotation_error)) @ pose.rotation.T @ J[3:]
        return J

    def rows(
        self, configuration: Configuration, dt: float, W: Matrix, e: Vector
    ) -> Vector:
        """Write the weighted rows."""
        error = self.error(configuration)
        step = self.gain * error if np.isfinite(error).all() else np.zeros(6)
        W[:] = self._costs[:, None] * self.jacobian(configuration, step[3:] / self.gain)
        saturate(step[:3], self._speeds[0] * dt)
        saturate(step[3:], self._speeds[1] * dt)
        e[:] = self._costs * step
        return error
