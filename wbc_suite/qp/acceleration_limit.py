"""Joint and base acceleration limits."""

from collections.abc import Mapping

import numpy as np

from wbc_suite.arguments import check_number
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.limit import BoxLimit, JointBounds

__all__ = ["AccelerationLimit"]


class AccelerationLimit(BoxLimit):
    """Keep `|v - v_previous| <= a_max dt`, and brake in time for position limits.

    With it a joint approaches its position limit no faster than it can brake:
    `v dt + v^2 / (2 a) <= d`; see `bounds.merge_bounds`.

    Args:
        default: Limit of every joint, rad/s^2 or m/s^2. 50 rad/s^2 bounds transients
            and was measured not to slow a reaching hand.
        joints: Limits of single joints by name, in place of the default.
        base_linear: Limit of each linear axis of a free or planar root, m/s^2.
        base_angular: Limit of each angular axis of such a root, rad/s^2.

    Raises:
        ConfigError: If a limit is not positive.
    """

    def __init__(
        self,
        default: float = 50.0,
        *,
        joints: Mapping[str, float] | None = None,
        base_linear: float = 20.0,
        base_angular: float = 30.0,
    ) -> None:
        self.default, self.joints = default, dict(joints or {})
        self.base_linear, self.base_angular = base_linear, base_angular
        for value in (*self.joints.values(), default, base_linear, base_angular):
            check_number("AccelerationLimit: a limit", value, above=0.0, endless=True)

    def apply(self, configuration: Configuration, bounds: JointBounds) -> None:
        """Set the window of every velocity."""
        limits = np.full(configuration.nv, self.default)
        limits[configuration.root_linear] = self.base_linear
        limits[configuration.root_angular] = self.base_angular
        for name, value in self.joints.items():
            joint = configuration.model.joints[configuration.joint_id(name)]
            limits[joint.idx_v : joint.idx_v + joint.nv] = value
        np.minimum(bounds.a_max, limits, out=bounds.a_max)
