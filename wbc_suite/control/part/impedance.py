"""Stiffness and damping of a part, fixed or set by the action."""

from typing import Literal, TypeAlias

import numpy as np
from pydantic import BaseModel, NonNegativeFloat

from wbc_suite.control.action import ActionPart, SliceKind, Unit
from wbc_suite.control.part.part_settings import (
    damping_of,
    limits_of,
    spread,
)
from wbc_suite.tomlfile import FROZEN
from wbc_suite.typing import Vector

Gains: TypeAlias = NonNegativeFloat | tuple[NonNegativeFloat, ...]
"""One gain for all axes or joints, or one for each."""


class ImpedanceSettings(BaseModel):
    """Settings of controllers with stiffness and damping, beside `PartSettings`.

    Attributes:
        impedance_mode: `fixed`: gains are those of the config. `variable_kp`: the
            action sets the stiffness, and damping is critical. `variable`: it sets
            stiffness and damping.
        kp: Stiffness, 1/s^2.
        damping_ratio: 1 is critically damped; `kd = 2 damping_ratio sqrt(kp)`.
        kd: Damping, 1/s, in place of the ratio.
        kp_limits: Least and greatest stiffness of an action, 1/s^2.
        kd_limits: Least and greatest damping of an action, 1/s.
    """

    model_config = FROZEN

    impedance_mode: Literal["fixed", "variable_kp", "variable"] = "fixed"
    kp: Gains = 150.0
    damping_ratio: Gains = 1.0
    kd: Gains | None = None
    kp_limits: tuple[Gains, Gains] = (0.0, 300.0)
    kd_limits: tuple[Gains, Gains] = (0.0, 100.0)


class Impedance:
    """Gains of a part, and the slices of the action that set them.

    Args:
        name: The part.
        labels: One word per axis or joint.
        config: Gains, their limits, and which of them the action sets.

    Attributes:
        slices: Slices after those of the motion: none, kp, or kp and kd.
        kp: Present stiffness, 1/s^2, shape (n,).
        kd: Present damping, 1/s, shape (n,).

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
    """

    def __init__(
        self, name: str, labels: tuple[str, ...], config: ImpedanceSettings
    ) -> None:
        size = len(labels)
        low, high = limits_of(config.kp_limits, size, "kp_limits")
        kd_low, kd_high = limits_of(config.kd_limits, size, "kd_limits")
        self._mode = config.impedance_mode
        self.kp = spread(config.kp, size, "kp")
        ratio = spread(config.damping_ratio, size, "damping_ratio")
        self.kd: Vector = damping_of(self.kp, ratio)
        if config.kd is not None:
            self.kd = spread(config.kd, size, "kd")
        self.slices: tuple[ActionPart, ...] = ()
        if self._mode != "fixed":
            self.kp = np.clip(self.kp, low, high)
            self.slices = (
                ActionPart(
                    name=f"{name}_kp",
                    kind=SliceKind.STIFFNESS,
                    labels=labels,
                    units=(Unit("1/s^2"),) * size,
                    low=tuple(low.tolist()),
                    high=tuple(high.tolist()),
                ),
            )
        if self._mode == "variable_kp":
            self.kd = damping_of(self.kp, 1.0)
        if self._mode == "variable":
            self.kd = np.clip(self.kd, kd_low, kd_high)
            self.slices += (
                ActionPart(
                    name=f"{name}_kd",
                    kind=SliceKind.DAMPING,
                    labels=labels,
                    units=(Unit("1/s"),) * size,
                    low=tuple(kd_low.tolist()),
                    high=tuple(kd_high.tolist()),
                ),
            )

    def take(self, values: Vector) -> None:
        """Take the values of `slices`, one after another."""
        size = len(self.kp)
        if self._mode == "fixed":
            return
        self.kp = values[:size].copy()
        self.kd = damping_of(self.kp, 1.0)
        if self._mode == "variable":
            self.kd = values[size:].copy()

    @property
    def hold_action(self) -> Vector:
        """Values that keep the present gains."""
        gains = [self.kp, self.kd][: len(self.slices)]
        return np.concatenate([*gains, np.zeros(0)])
