"""Bring a frame to a pose, in the world or relative to another frame."""

from typing import Any, ClassVar

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_array
from wbc_suite.compiling import inner, record_type
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays, pack_pose
from wbc_suite.qp.lie import LARGEST_FINITE, inverse_left_jacobian, is_usable, log3
from wbc_suite.qp.part import SharedRow, place_frame
from wbc_suite.qp.task import RowTask, cost_vector
from wbc_suite.typing import Indices, Matrix, Vector

FRAME = record_type(
    ("joint", "i8"),  # parent joint of the frame
    ("offset", "f8", (12,)),  # its pose in the joint, [R p] by columns
    ("target", "f8", (12,)),  # target pose, [R p] row by row
)
"""Numbers of a frame that has a target."""


@inner
def frame_error(
    robot: RobotArrays, own: Vector, dt: float, rows: Matrix, values: Vector
) -> None:
    """Write Jacobian and error of a frame; see `FrameTask` for the equations.

    For a target that is not finite the error is NaN, and the Jacobian that of no
    rotation.
    """
    frame, T = own.view(FRAME)[0], np.empty(12)
    E, A, target, error = np.empty((3, 3)), np.empty((3, 3)), frame.target, values
    place_frame(robot, frame.joint, frame.offset, T)
    finite = relative_rotation(T, target, E)
    rotation = error[3:]
    angle = log3(E, rotation)
    inverse_left_jacobian(rotation, angle, E)
    for i in range(3):
        error[i] = target[4 * i + 3] - T[9 + i]
        for j in range(3):  # A = Jl^-1 R^T maps world rates
            A[i, j] = E[i, 0] * T[j] + E[i, 1] * T[3 + j] + E[i, 2] * T[6 + j]
    columns, joints, j = robot.jacobian, robot.joints, frame.joint
    while j > 0:
        joint = joints[j]
        for col in range(joint.v_start, joint.v_start + joint.v_count):
            J = columns[col]
            x, y, z = J[3], J[4], J[5]
            rows[0, col] = J[0] + y * T[11] - z * T[10]
            rows[1, col] = J[1] + z * T[9] - x * T[11]
            rows[2, col] = J[2] + x * T[10] - y * T[9]
            for i in range(3):
                rows[3 + i, col] = A[i, 0] * x + A[i, 1] * y + A[i, 2] * z
        j = joint.parent
    if not finite:
        error[:] = np.nan


@inner
def relative_rotation(T: Vector, target: Vector, out: Matrix) -> bool:
    """Write `R_wf^T R_wt`, or I for a target that is not finite; return if it is.

    T is packed by columns, the target row by row.
    """
    finite = True
    for i in range(12):
        finite &= abs(target[i]) < LARGEST_FINITE
    for i in range(3):
        for j in range(3):
            out[i, j] = 1.0 if i == j else 0.0
            if finite:
                out[i, j] = T[3 * i] * target[j]
                out[i, j] += T[3 * i + 1] * target[4 + j] + T[3 * i + 2] * target[8 + j]
    return finite


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
        position_cost: [cost]/m, one number or one per world axis.
        orientation_cost: [cost]/rad, one number or one per axis of the frame.
        target: Target pose; without one the pose at binding time is held.

    Gain and level are those of `RowTask`, speeds in m/s and rad/s. Reports call the
    task by its frame.

    Source: Lynch and Park (2017), "Modern Robotics", section 6.3; SO(3) Jacobian from
    Chirikjian (2012), "Stochastic Models, Information Theory, and Lie Groups", 10.86.
    """

    kernel: ClassVar[Any] = frame_error

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
        super().__init__(
            name or frame,
            dim=6,
            cost=pose_costs(name or frame, position_cost, orientation_cost),
            gain=gain,
            level=level,
            max_speed=max_linear_speed,
            max_angular_speed=max_angular_speed,
            angular_start=3,
        )
        self.frame, self.target_row = frame, SharedRow(12)
        if target is not None:
            self.set_target(target)

    def set_costs(
        self,
        *,
        position: float | Vector | None = None,
        orientation: float | Vector | None = None,
    ) -> None:
        """Change the costs, [cost]/m and [cost]/rad."""
        position = self.cost[:3] if position is None else position
        orientation = self.cost[3:] if orientation is None else orientation
        self.cost_row.set(pose_costs(self.name, position, orientation))

    def set_target(self, target: pin.SE3 | Matrix) -> None:
        """Set the target pose T_wt: an SE3 or a homogeneous matrix, shape (4, 4).

        Values that are not finite are accepted: a tick holds the frame and reports it.

        Raises:
            ConfigError: If the shape is wrong or the rotation is no rotation.
        """
        self.target_row.set(homogeneous(self.name, target).ravel()[:12])

    @property
    def target(self) -> pin.SE3:
        """Target pose T_wt, a copy."""
        pose = self.target_row.values.reshape(3, 4)
        return pin.SE3(pose[:, :3].copy(), pose[:, 3].copy())

    def bind(self, configuration: Configuration) -> None:
        """Resolve the frame; without a target, hold its present pose."""
        frame = configuration.model.frames[configuration.frame_id(self.frame)]
        self._frame = np.zeros(1, FRAME)
        self._frame["joint"] = frame.parentJoint
        self._frame["offset"] = pack_pose(frame.placement)
        if not self.target_row.is_set:
            self.set_target(configuration.frame_pose(self.frame))

    def support(self, configuration: Configuration) -> Indices:
        """Return the velocity indices between the root and the frame."""
        return configuration.support(self.frame)

    def own(self, configuration: Configuration) -> Vector:
        """Return a `FRAME` record."""
        self._frame["target"] = self.target_row.values
        return self._frame.view(np.float64).copy()


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


def pose_costs(
    owner: str, position: float | Vector, orientation: float | Vector
) -> Vector:
    """Return the costs of position, then of orientation, shape (6,)."""
    parts = cost_vector(owner, position, 3), cost_vector(owner, orientation, 3)
    return np.concatenate(parts)


def homogeneous(owner: str, pose: pin.SE3 | Matrix) -> Matrix:
    """Return a pose as a matrix, shape (4, 4), or raise; see `FrameTask.set_target`."""
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
