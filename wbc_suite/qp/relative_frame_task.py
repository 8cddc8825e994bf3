"""Bring a frame to a pose relative to another frame."""

import numpy as np
import pinocchio as pin

from wbc_suite.kinematics import Configuration
from wbc_suite.qp.frame_task import homogeneous, pose_costs
from wbc_suite.qp.lie import is_usable
from wbc_suite.qp.task import RowTask
from wbc_suite.typing import Matrix, Vector


class RelativeFrameTask(RowTask):
    """Bring a frame f to a target pose T_rt in another frame r.

        e_p = p_rt - p_rf                                      m, axes of r
        e_r = log3(R_rf^T R_rt)                                rad, axes of f
        J_p = R_wr^T (J_vf - J_vr + [p_wf - p_wr]x J_wr)       v: linear rows
        J_r = Jl^-1(e_r) R_wf^T (J_wf - J_wr)                  w: angular rows

    All Jacobians are aligned; the velocity of f as r sees it is
    `v_f - v_r - w_r x (p_wf - p_wr)`.

    Args:
        frame: Name of f.
        root: Name of r.
        position_cost: [cost]/m, one number or one per axis of r.
        orientation_cost: [cost]/rad, one number or one per axis of f.
        target: Pose T_rt; without one the pose at binding time is held.

    Gain and level are those of `RowTask`, speeds in m/s and rad/s and relative. Reports
    call the task "frame in root".
    """

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
        name = name or f"{frame} in {root}"
        super().__init__(
            name,
            dim=6,
            cost=pose_costs(name, position_cost, orientation_cost),
            gain=gain,
            level=level,
            max_speed=max_linear_speed,
            max_angular_speed=max_angular_speed,
            angular_start=3,
        )
        self.frame, self.root = frame, root
        self.target: pin.SE3 | None = None
        if target is not None:
            self.set_target(target)

    def set_target(self, target: pin.SE3 | Matrix) -> None:
        """Set the pose T_rt, see `FrameTask.set_target`."""
        T = homogeneous(self.name, target)
        self.target = pin.SE3(T[:3, :3].copy(), T[:3, 3].copy())

    def bind(self, configuration: Configuration) -> None:
        """Resolve both frames; without a target, hold the present relative pose."""
        self._f = configuration.frame_id(self.frame)
        self._r = configuration.frame_id(self.root)
        if self.target is None:
            root = configuration.frame_pose(self._r)
            self.target = root.actInv(configuration.frame_pose(self._f))

    def evaluate(
        self, configuration: Configuration, error: Vector, jacobian: Matrix
    ) -> None:
        """Write (e_p, e_r), m and rad, and its Jacobian."""
        assert self.target is not None
        root = configuration.frame_pose(self._r)
        pose = configuration.frame_pose(self._f)
        seen, rotation_error = root.actInv(pose), np.zeros(3)
        error[:] = np.nan
        if is_usable(self.target.homogeneous):
            rotation_error = pin.log3(seen.rotation.T @ self.target.rotation)
            error[:3] = self.target.translation - seen.translation
            error[3:] = rotation_error
        J_root = configuration.frame_jacobian(self._r, "aligned").copy()
        J = configuration.frame_jacobian(self._f, "aligned") - J_root
        arm = pose.translation - root.translation
        J[:3] += pin.skew(arm) @ J_root[3:]  # - w x arm = arm x w
        jacobian[:3] = root.rotation.T @ J[:3]
        # Jlog3 is the inverse right Jacobian; Jl^-1(r) = Jr^-1(-r).
        turn = pin.Jlog3(pin.exp3(-rotation_error)) @ pose.rotation.T
        jacobian[3:] = turn @ J[3:]
