"""Settings that the configs of part controllers share, and how to apply them."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import BaseModel, Field, NonNegativeFloat

from wbc_suite.control.action import Unit
from wbc_suite.control.law.law import Law
from wbc_suite.errors import ConfigError
from wbc_suite.tomlfile import FROZEN, FrozenModel
from wbc_suite.typing import Vector

InputType = Literal["delta", "absolute"]
InputFrame = Literal["world", "base", "eef"]
Numbers: TypeAlias = float | tuple[float, ...]
"""One number for all axes or joints, or one for each."""

Range: TypeAlias = tuple[Numbers, Numbers]
"""Least and greatest values."""

ROUNDING = 1e-12
"""m or rad; a smaller step counts as zero."""

REACH = 10.0
"""Bound of absolute positions, m; larger ones are mistakes in the input."""


class GripConfig(FrozenModel):
    """Input and speed of a gripper.

    Attributes:
        input: `synergy`: one value per synergy, -1 open to 1 closed. `width`: the width
            between two fingers, m.
        speed: Velocity of the setpoints, in values per second (2 opens a closed gripper
            in 1 s) or m/s; setpoints jump when absent.
    """

    type: Literal["GRIP"] = "GRIP"
    input: Literal["synergy", "width"] = "synergy"
    speed: Annotated[float, Field(gt=0.0)] | None = None


class PartSettings(BaseModel):
    """Settings of every part controller that reads the action.

    Attributes:
        input_min: Values of the action that mean `output_min`.
        input_max: Values of the action that mean `output_max`.
        interpolation: `linear`: the reference moves to a new goal at constant velocity.
        ramp_ratio: Part of the time between two actions that this takes.
        goal_update_mode: Whether a delta counts from where the part is (`achieved`) or
            from its last goal (`desired`). A delta of zero keeps the goal in both.
        torque_limits: Least and greatest torques of the joints, N m or N, within those
            of the motors.
        disturbance_observer: Bandwidth, 1/s, at which forces that the model lacks are
            estimated and compensated; 0 is off. At 20 /s the estimate of a load
            reaches 86 % after 0.1 s. In contact the force grows up to the motors'
            limits.
        use_torque_compensation: Whether gravity and Coriolis forces are compensated.
        gripper: The gripper at the end of the part.
    """

    model_config = FROZEN

    input_min: Numbers = -1.0
    input_max: Numbers = 1.0
    interpolation: Literal["linear"] | None = None
    ramp_ratio: Annotated[float, Field(gt=0.0, le=1.0)] = 0.2
    goal_update_mode: Literal["achieved", "desired"] = "achieved"
    torque_limits: Range | None = None
    disturbance_observer: NonNegativeFloat = 0.0
    use_torque_compensation: bool = True
    gripper: GripConfig | None = GripConfig()

    def ramp(self, period: float) -> float:
        """Return the duration of a motion to a new goal, s; 0 where it jumps."""
        return self.ramp_ratio * period if self.interpolation == "linear" else 0.0


class InputScaling:
    """Maps values of an action linearly onto outputs.

    Args:
        size: Number of values.
        settings: Settings with the range of the input.
        output_min: Outputs at `input_min`, their units.
        output_max: Outputs at `input_max`.

    Attributes:
        low: Least inputs, shape (size,).
        high: Greatest inputs, shape (size,).
        gain: Output per input, shape (size,).
        offset: Output of the input 0, shape (size,).

    Raises:
        ConfigError: If a number of values is wrong, or an input range is empty.
    """

    def __init__(
        self,
        size: int,
        settings: PartSettings,
        output_min: Numbers,
        output_max: Numbers,
    ) -> None:
        low, high, out_low, out_high = (
            spread(x, size, key)
            for x, key in (
                (settings.input_min, "input_min"),
                (settings.input_max, "input_max"),
                (output_min, "output_min"),
                (output_max, "output_max"),
            )
        )
        if not (low < high).all():
            raise ConfigError("'input_min' must be below 'input_max' in every value.")
        self.low, self.high = low, high
        self.gain: Vector = (out_high - out_low) / (high - low)
        middle = 0.5 * (out_high + out_low)
        self.offset: Vector = middle - 0.5 * self.gain * (high + low)

    def __call__(self, values: Vector) -> Vector:
        """Return the outputs, shape (size,)."""
        return self.offset + self.gain * values

    def inverse(self, outputs: Vector) -> Vector:
        """Return the inputs of some outputs; zero where the output is constant."""
        gain = np.where(self.gain == 0.0, np.inf, self.gain)
        return (outputs - self.offset) / gain

    def units(self, units: Sequence[Unit]) -> tuple[Unit, ...]:
        """Return what a value of 1 means, of the given units of the outputs."""
        most = self(np.ones(len(units))).tolist()
        return tuple(Unit(u.symbol, x) for u, x in zip(units, most, strict=True))

    @property
    def neutral(self) -> Vector:
        """The inputs whose outputs are zero, or nearest to it."""
        inputs = self.inverse(np.zeros_like(self.gain))
        return np.clip(inputs, self.low, self.high)


def spread(values: Numbers, size: int, key: str) -> Vector:
    """Return one value for each axis or joint, shape (size,), read-only.

    Raises:
        ConfigError: If there is neither one value nor one for each.
    """
    array = np.asarray(values, dtype=np.float64)
    if array.shape not in ((), (1,), (size,)):
        raise ConfigError(
            f"key '{key}': {array.size} values, where 1 or {size} are needed."
        )
    return np.broadcast_to(array, size)


def limits_of(given: Range, size: int, key: str) -> tuple[Vector, Vector]:
    """Return least and greatest values, shape (size,) each.

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
    """
    low, high = spread(given[0], size, key), spread(given[1], size, key)
    if not (low <= high).all():
        raise ConfigError(f"key '{key}': least values {given[0]} exceed {given[1]}.")
    return low, high


def apply_torque_settings(law: Law, settings: PartSettings) -> None:
    """Set a law's torque limits, compensation and disturbance observer."""
    law.record["observer"] = settings.disturbance_observer
    law.record["compensation"] = float(settings.use_torque_compensation)
    if settings.torque_limits is not None:
        limits = limits_of(settings.torque_limits, len(law.joints), "torque_limits")
        law.narrow(*limits)


def damping_of(kp: Any, ratio: Any) -> Any:
    """Return kd, 1/s, of stiffnesses and damping ratios."""
    return 2.0 * ratio * kp**0.5
