"""Joint and base velocity limits."""

from collections.abc import Mapping

import numpy as np

from wbc_suite.arguments import check_number
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.limit import BoxLimit, JointBounds

__all__ = ["VelocityLimit"]


class VelocityLimit(BoxLimit):
    """Keep `|dq| <= v_max dt`.

    Joints take the model's velocity limits; a value that is zero, negative or infinite
    means that the model knows none. A free or planar root takes the base limits.

    Args:
        joints: Limits of single joints by name, rad/s or m/s, in place of the model's.
        base_linear: Limit of each linear axis of a free or planar root, m/s.
        base_angular: Limit of each angular axis of a free or planar root, rad/s.
        scale: Factor on all of the model's limits, (0, 1].

    Raises:
        ConfigError: If a limit is not positive, or the scale is out of range.
    """

    def __init__(
        self,
        joints: Mapping[str, float] | None = None,
        *,
        base_linear: float = 1.0,
        base_angular: float = 1.5,
        scale: float = 1.0,
    ) -> None:
        self.joints = dict(joints or {})
        self.base_linear, self.base_angular = base_linear, base_angular
        self.scale = scale
        for value in (*self.joints.values(), base_linear, base_angular):
            check_number("VelocityLimit: a limit", value, above=0.0, endless=True)
        check_number("VelocityLimit: scale", scale, above=0.0, most=1.0)

    def apply(self, configuration: Configuration, bounds: JointBounds) -> None:
        """Take the limits from the model, the root's from the options."""
        known = np.array(configuration.model.velocityLimit, dtype=np.float64)
        limits = np.where((known > 0.0) & (known < 1e10), known * self.scale, np.inf)
        limits[configuration.root_linear] = self.base_linear
        limits[configuration.root_angular] = self.base_angular
        for name, value in self.joints.items():
            joint = configuration.model.joints[configuration.joint_id(name)]
            limits[joint.idx_v : joint.idx_v + joint.nv] = value
        np.minimum(bounds.v_max, limits, out=bounds.v_max)
