"""Point an axis of a frame at a point."""

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_array
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.lie import is_usable
from wbc_suite.qp.task import RowTask
from wbc_suite.typing import Matrix, Vector

_LEAST_DISTANCE = 0.02  # m; nearer points have no direction
_BEHIND = 0.35  # rad from the opposite direction; all ways to a point there are alike
_MOST_SLOPE = np.pi
"""Greatest derivative of the error's direction, rad/rad; it grows without bound towards
the opposite direction, where it would hold the axis. Exact up to 132 degrees."""


class LookAtTask(RowTask):
    """Point an axis a of a frame at a point p of the world: gaze, a lamp, a nozzle.

    With the direction `d = (p - p_wf) / r`, `r = |p - p_wf|`, and the same in the
    frame's axes, `u = R_wf^T d`, the error is the rotation vector from the axis to the
    point, with t the tangent at a towards u and n = a x t:

        e = theta n,   theta = angle from a to u                         rad
        J_u = -[u]x J_w_local + R_wf^T (I - d d^T) J_v / r    J_v: linear, aligned
        J = (n (cos(theta) t - sin(theta) a)^T - theta / sin(theta) t n^T) J_u

    It is as long as the way, so a point behind the frame pulls with full strength.

    Nearer than 2 cm, r is 2 cm and `J_v / r` is not projected: d is shorter than 1, and
    `e = |d| theta n - (1 - |d|) a`: the frame backs off until there is a direction
    again. Were it to turn with every millimetre, a frame on top of its point would
    flutter.

    The rotation about the axis stays free.

    Args:
        axis: The axis a in the frame, shape (3,); normalised.
        target: Point p, m, world axes, shape (3,); without one, 1 m along the axis at
            binding time.

    Other arguments are those of `RowTask`, in rad. Reports call the task "frame looks".

    Raises:
        ConfigError: If the axis has no length.
    """

    unit = "rad"

    def __init__(
        self,
        frame: str,
        *,
        axis: Vector | tuple[float, float, float] = (1.0, 0.0, 0.0),
        target: Vector | None = None,
        cost: float = 1.0,
        gain: float = 1.0,
        level: int = 0,
        max_angular_speed: float = 3.0,
        name: str | None = None,
    ) -> None:
        super().__init__(
            name or f"{frame} looks",
            dim=3,
            cost=cost,
            gain=gain,
            level=level,
            max_speed=max_angular_speed,
        )
        self.frame = frame
        direction = check_array(f"Task '{self.name}': the axis", axis, (3,))
        length = float(np.linalg.norm(direction))
        if not 0.0 < length < np.inf:
            raise ConfigError(f"Task '{self.name}': the axis {axis} has no direction.")
        self._axis = direction / length
        self.target: Vector | None = None
        if target is not None:
            self.set_target(target)

    def set_target(self, target: Vector) -> None:
        """Set the point p, m; ConfigError if its shape is not (3,)."""
        what = f"Task '{self.name}': the target"
        self.target = check_array(what, target, (3,)).copy()

    def bind(self, configuration: Configuration) -> None:
        """Resolve the frame; without a target, look where the axis points now."""
        self._f = configuration.frame_id(self.frame)
        if self.target is None:
            pose = configuration.frame_pose(self._f)
            self.target = pose.translation + pose.rotation @ self._axis

    def evaluate(
        self, configuration: Configuration, error: Vector, jacobian: Matrix
    ) -> None:
        """Write the rotation vector from the axis to the point, and its Jacobian."""
        assert self.target is not None
        pose = configuration.frame_pose(self._f)
        R, usable = pose.rotation, is_usable(self.target)
        offset = R @ self._axis  # for a point that is not finite: along the axis
        if usable:
            offset = self.target - pose.translation
        distance = max(float(np.linalg.norm(offset)), _LEAST_DISTANCE)
        d = offset / distance
        J = configuration.frame_jacobian(self._f, "aligned")
        J_w = R.T @ J[3:]
        along = d if distance > _LEAST_DISTANCE else np.zeros(3)
        linear = R.T @ (J[:3] - np.outer(along, d @ J[:3])) / distance
        a, length = self._axis, float(np.linalg.norm(d))
        u = R.T @ d / length if length > 0.0 else a
        t = self._tangent(u, J_w)
        n, cosine, sine = np.cross(a, t), float(a @ u), float(t @ u)
        angle = np.arctan2(sine, cosine)
        slope = min(angle / sine, _MOST_SLOPE) if sine > 1e-9 else 1.0
        error[:] = length * angle * n - (1.0 - length) * a if usable else np.nan
        turn = np.outer(n, cosine * t - sine * a) - slope * np.outer(t, n)
        turn += np.outer(angle * n + a, u)
        jacobian[:] = turn @ (linear - length * pin.skew(u) @ J_w)

    def _tangent(self, u: Vector, J_w: Matrix) -> Vector:
        """Return the unit vector at the axis a towards u, in the frame's axes, (3,).

        For a point behind it is that in which the robot turns the axis most easily.
        """
        a = self._axis
        across = u - (a @ u) * a
        length = float(np.linalg.norm(across))
        if length > (_BEHIND if a @ u < 0.0 else 1e-9):
            return across / length
        motions = np.hstack([J_w, 1e-6 * np.eye(3)])  # never none
        ways, _, _ = np.linalg.svd(pin.skew(a) @ motions, full_matrices=False)
        return ways[:, 0] if ways[:, 0] @ u >= 0.0 else -ways[:, 0]
