"""Stiffness and damping of a part, fixed or set by the action."""

from typing import Literal, TypeAlias

import numpy as np
from pydantic import NonNegativeFloat

from wbc_suite.config_files import FrozenModel
from wbc_suite.control.action import ActionPart, SliceKind, Unit
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.part_settings import damping_of, limits_of, spread
from wbc_suite.typing import Vector

Gains: TypeAlias = NonNegativeFloat | tuple[NonNegativeFloat, ...]
"""One gain for all axes or joints, or one for each."""


class ImpedanceSettings(FrozenModel):
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

    impedance_mode: Literal["fixed", "variable_kp", "variable"] = "fixed"
    kp: Gains = 150.0
    damping_ratio: Gains = 1.0
    kd: Gains | None = None
    kp_limits: tuple[Gains, Gains] = (0.0, 300.0)
    kd_limits: tuple[Gains, Gains] = (0.0, 100.0)


class Impedance:
    """Gains of the axes or joints of a part, and slices of the action that set them.

    Raises ConfigError if a number of values is wrong, or a range is empty.

    Attributes:
        slices: Slices after those of the motion: none, kp, or kp and kd.
        kp: Present stiffness, 1/s^2, shape (n,).
        kd: Present damping, 1/s, shape (n,).
    """

    def __init__(
        self, name: str, labels: tuple[str, ...], config: ImpedanceSettings
    ) -> None:
        size = len(labels)
        kp_limits = limits_of(config.kp_limits, size, "kp_limits")
        kd_limits = limits_of(config.kd_limits, size, "kd_limits")
        ratio = spread(config.damping_ratio, size, "damping_ratio")
        self._mode = config.impedance_mode
        self.kp: Vector = spread(config.kp, size, "kp").copy()
        self.kd: Vector = damping_of(self.kp, ratio)
        if config.kd is not None:
            self.kd = spread(config.kd, size, "kd").copy()
        stiffness = _slice(f"{name}_kp", SliceKind.STIFFNESS, labels, kp_limits)
        damping = _slice(f"{name}_kd", SliceKind.DAMPING, labels, kd_limits)
        self.slices: tuple[ActionPart, ...] = ()
        if self._mode != "fixed":
            self.kp = np.clip(self.kp, *kp_limits)
            self.slices = (stiffness,)
        if self._mode == "variable_kp":
            self.kd = damping_of(self.kp, 1.0)
        if self._mode == "variable":
            self.kd = np.clip(self.kd, *kd_limits)
            self.slices = (stiffness, damping)

    def take(self, values: Vector) -> None:
        """Take the values of `slices`, one after another."""
        size = len(self.kp)
        if self._mode == "fixed":
            return
        self.kp[:] = values[:size]
        self.kd[:] = damping_of(self.kp, 1.0)
        if self._mode == "variable":
            self.kd[:] = values[size:]

    @property
    def memory(self) -> Parts:
        """Gains that the action sets; views."""
        return (self.kp, self.kd)[: 2 if self.slices else 0]

    @property
    def hold_action(self) -> Vector:
        """Values that keep the present gains."""
        gains = [self.kp, self.kd][: len(self.slices)]
        return np.concatenate([*gains, np.zeros(0)])


def _slice(
    name: str,
    kind: SliceKind,
    labels: tuple[str, ...],
    limits: tuple[Vector, Vector],
) -> ActionPart:
    unit = Unit("1/s^2" if kind is SliceKind.STIFFNESS else "1/s")
    low, high = (tuple(limit.tolist()) for limit in limits)
    units = (unit,) * len(labels)
    return ActionPart(
        name=name, kind=kind, labels=labels, units=units, low=low, high=high
    )
