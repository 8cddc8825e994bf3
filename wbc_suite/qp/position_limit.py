"""Joint position limits."""

from collections.abc import Mapping

import numpy as np

from wbc_suite.arguments import check_number
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.limit import BoxLimit, JointBounds

__all__ = ["PositionLimit"]


class PositionLimit(BoxLimit):
    """Keep `q_lower <= q + dq <= q_upper` for every one-parameter joint.

    A joint outside a limit returns at its greatest speed; see `bounds.merge_bounds`.

    Args:
        gain: Fraction of the distance to a limit that one step may cover, (0, 1].
        margin: Distance kept from each limit, rad or m.
        joints: Narrower ranges of single joints by name, rad or m.

    Raises:
        ConfigError: If the gain is out of range or the margin negative.
    """

    def __init__(
        self,
        *,
        gain: float = 1.0,
        margin: float = 0.0,
        joints: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self.gain = check_number("PositionLimit: gain", gain, above=0.0, most=1.0)
        self.margin = check_number("PositionLimit: margin", margin, least=0.0)
        self.joints = dict(joints or {})

    def apply(self, configuration: Configuration, bounds: JointBounds) -> None:
        """Take the limits from the model, less the margin."""
        model = configuration.model
        for i, k in enumerate(bounds.q_index):
            if k < 0:
                continue
            lower = float(model.lowerPositionLimit[k])
            upper = float(model.upperPositionLimit[k])
            if not lower < upper:  # how Pinocchio says "none"
                continue
            margin = min(self.margin, 0.5 * (upper - lower))
            bounds.q_lower[i] = max(bounds.q_lower[i], lower + margin)
            bounds.q_upper[i] = min(bounds.q_upper[i], upper - margin)
        for name, (lower, upper) in self.joints.items():
            i = configuration.model.joints[configuration.joint_id(name)].idx_v
            bounds.q_lower[i] = max(bounds.q_lower[i], lower)
            bounds.q_upper[i] = min(bounds.q_upper[i], upper)
        # Limits of 1e20 and the like are "none" too, and would spoil sums.
        bounds.q_lower[bounds.q_lower < -1e10] = -np.inf
        bounds.q_upper[bounds.q_upper > 1e10] = np.inf
        bounds.position_gain = min(bounds.position_gain, self.gain)
