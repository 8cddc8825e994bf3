"""Limits of joints and of the base: position, velocity, acceleration."""

from collections.abc import Mapping

import numpy as np

from wbc_suite.arguments import check_number
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.limit import BoxLimit, JointBounds, joint_values

_NO_LIMIT = 1e10
"""Limits of a model beyond it are none: some files write 1e20."""


class PositionLimit(BoxLimit):
    """Keep `q_lower <= q + dq <= q_upper` for every one-parameter joint.

    A joint outside a limit returns at its greatest speed; see `joint_window`.

    Args:
        gain: Fraction of the distance to a limit that one step may cover, (0, 1].
        margin: Distance kept from each limit, rad or m.
        joints: Narrower ranges of single joints by name, rad or m.

    Raises:
        ConfigError: If the gain is out of range, the margin negative, or a range empty
            or outside the model's.
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
        for name, (lower, upper) in self.joints.items():
            if not lower <= upper:
                raise ConfigError(
                    f"PositionLimit: the range of '{name}' is {lower} to {upper}, but "
                    "must not end before it begins."
                )

    def apply(self, configuration: Configuration, bounds: JointBounds) -> None:
        """Take the limits from the model, less the margin."""
        model = configuration.model
        for i, k in enumerate(bounds.q_index):
            if k < 0:
                continue
            lower = float(model.lowerPositionLimit[k])
            upper = float(model.upperPositionLimit[k])
            if not lower < upper:  # Pinocchio's "no limit"
                continue
            margin = min(self.margin, 0.5 * (upper - lower))
            bounds.q_lower[i] = max(bounds.q_lower[i], lower + margin)
            bounds.q_upper[i] = min(bounds.q_upper[i], upper - margin)
        for name, (lower, upper) in self.joints.items():
            i = model.joints[configuration.joint_id(name)].idx_v
            if not (lower <= bounds.q_upper[i] and upper >= bounds.q_lower[i]):
                raise ConfigError(
                    f"PositionLimit: '{name}' is in {bounds.q_lower[i]:g} to "
                    f"{bounds.q_upper[i]:g}, which has nothing in common with "
                    f"{lower} to {upper}."
                )
            bounds.q_lower[i] = max(bounds.q_lower[i], lower)
            bounds.q_upper[i] = min(bounds.q_upper[i], upper)
        bounds.q_lower[bounds.q_lower < -_NO_LIMIT] = -np.inf
        bounds.q_upper[bounds.q_upper > _NO_LIMIT] = np.inf
        np.minimum(bounds.position_gain, self.gain, out=bounds.position_gain)


class VelocityLimit(BoxLimit):
    """Keep `|dq| <= v_max dt`.

    Joints take the model's velocity limits; a value that is zero, negative or infinite
    means that the model has none. A free or planar root takes the base limits.

    Args:
        joints: Limits of single joints by name, rad/s or m/s, in place of the model's.
        base_linear: Limit of each linear axis of a free or planar root, m/s.
        base_angular: Limit of each angular axis of such a root, rad/s.
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
        for value in (*self.joints.values(), base_linear, base_angular):
            check_number("VelocityLimit: a limit", value, above=0.0, allow_inf=True)
        self.scale = check_number("VelocityLimit: scale", scale, above=0.0, most=1.0)

    def apply(self, configuration: Configuration, bounds: JointBounds) -> None:
        """Take the limits from the model, the root's from the options."""
        known = configuration.model.velocityLimit
        limits = joint_values(
            configuration,
            np.where((known > 0.0) & (known < _NO_LIMIT), known * self.scale, np.inf),
            self.joints,
            root_linear=self.base_linear,
            root_angular=self.base_angular,
        )
        np.minimum(bounds.v_max, limits, out=bounds.v_max)


class AccelerationLimit(BoxLimit):
    """Keep `|v - v_previous| <= a_max dt`, and brake in time for position limits.

    With it a joint approaches its position limit no faster than it can brake:
    `v dt + v^2 / (2 a) <= d`; see `joint_window.merge_bounds`.

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
            check_number("AccelerationLimit: a limit", value, above=0.0, allow_inf=True)

    def apply(self, configuration: Configuration, bounds: JointBounds) -> None:
        """Set the window of every velocity."""
        limits = joint_values(
            configuration,
            self.default,
            self.joints,
            root_linear=self.base_linear,
            root_angular=self.base_angular,
        )
        np.minimum(bounds.a_max, limits, out=bounds.a_max)
