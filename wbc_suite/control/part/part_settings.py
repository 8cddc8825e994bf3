"""Settings that the configs of part controllers share, and how to apply them."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import Field, NonNegativeFloat

from wbc_suite.config_files import FrozenModel
from wbc_suite.control.action import ActionPart, SliceKind, Unit
from wbc_suite.control.law.law import Law
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

InputType = Literal["delta", "absolute"]
InputFrame = Literal["world", "base", "eef"]
GoalUpdate = Literal["achieved", "desired"]
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


class PartSettings(FrozenModel):
    """Settings of every part controller that reads the action.

    Attributes:
        input_type: `delta`: values are scaled. `absolute`: they are goals as they are.
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

    input_type: InputType = "delta"
    input_min: Numbers = -1.0
    input_max: Numbers = 1.0
    interpolation: Literal["linear"] | None = None
    ramp_ratio: Annotated[float, Field(gt=0.0, le=1.0)] = 0.2
    goal_update_mode: GoalUpdate = "achieved"
    torque_limits: Range | None = None
    disturbance_observer: NonNegativeFloat = 0.0
    use_torque_compensation: bool = True
    gripper: GripConfig | None = GripConfig()

    def ramp(self, period: float) -> float:
        """Return the duration of a motion to a new goal, s; 0 where it jumps."""
        return self.ramp_ratio * period if self.interpolation == "linear" else 0.0


class InputScaling:
    """Maps `size` values of an action linearly onto outputs.

    Raises ConfigError if a number of values is wrong, or an input range is empty.

    Attributes:
        low: Least inputs, shape (size,).
        high: Greatest inputs, shape (size,).
        gain: Output per input, shape (size,).
        offset: Output of the input 0, shape (size,).
    """

    def __init__(
        self,
        size: int,
        settings: PartSettings,
        output_min: Numbers,
        output_max: Numbers,
    ) -> None:
        self.low = spread(settings.input_min, size, "input_min")
        self.high = spread(settings.input_max, size, "input_max")
        least = spread(output_min, size, "output_min")
        greatest = spread(output_max, size, "output_max")
        if not (self.low < self.high).all():
            raise ConfigError("'input_min' must be below 'input_max' in every value.")
        self.gain: Vector = (greatest - least) / (self.high - self.low)
        middle = 0.5 * (greatest + least)
        self.offset: Vector = middle - 0.5 * self.gain * (self.high + self.low)

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


class SliceInput:
    """A slice of the action, and what its values mean by the config's `input_type`.

    Args:
        units: Units of the outputs.
        outputs: Outputs at `input_min` and at `input_max`.
        limits: Least and greatest outputs, shape (n,) each.

    Attributes:
        action: The slice.
        scaled: Whether values are scaled; otherwise they are outputs.
        scaling: Scales them.
    """

    def __init__(
        self,
        name: str,
        kind: SliceKind,
        *,
        labels: tuple[str, ...],
        units: tuple[Unit, ...],
        config: PartSettings,
        outputs: tuple[Numbers, Numbers],
        limits: tuple[Vector, Vector],
    ) -> None:
        self.scaling = InputScaling(len(labels), config, *outputs)
        self.scaled = config.input_type == "delta"
        self._limits = limits
        if self.scaled:
            limits = self.scaling.low, self.scaling.high
            units = self.scaling.units(units)
        low, high = (tuple(limit.tolist()) for limit in limits)
        self.action = ActionPart(
            name=name,
            kind=kind,
            labels=labels,
            units=units,
            low=low,
            high=high,
            wraps=kind is SliceKind.POSE and not self.scaled,
        )

    def __call__(self, values: Vector) -> Vector:
        """Return the outputs within their limits, shape (n,)."""
        return self.clip(self.scaling(values) if self.scaled else values)

    def clip(self, outputs: Vector) -> Vector:
        """Return outputs within their limits, shape (n,)."""
        low, high = self._limits
        return np.minimum(np.maximum(outputs, low), high)

    @property
    def neutral(self) -> Vector:
        """The values whose outputs are zero, or nearest to it, shape (n,)."""
        zero = np.zeros_like(self.scaling.gain)
        return self.scaling.neutral if self.scaled else self.clip(zero)


def spread(values: Numbers, size: int, key: str) -> Vector:
    """Return one value for each axis or joint, shape (size,), read-only.

    Raises:
        ConfigError: If there is neither one value nor one for each.
    """
    array = np.asarray(values, dtype=np.float64)
    if array.shape not in ((), (1,), (size,)):
        raise ConfigError(f"key '{key}': {array.size} values instead of 1 or {size}.")
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


def narrowed(
    low: Vector, high: Vector, given: Range, key: str
) -> tuple[Vector, Vector]:
    """Return limits within the given ones as well, shape (n,) each.

    Raises:
        ConfigError: If a number of values is wrong, or nothing is left of a range.
    """
    least, greatest = limits_of(given, len(low), key)
    least, greatest = np.maximum(low, least), np.minimum(high, greatest)
    if not (least <= greatest).all():
        k = int(np.argmin(least <= greatest))
        raise ConfigError(
            f"key '{key}': {given[0]} to {given[1]} has nothing in common with the "
            f"robot's own {low[k]:g} to {high[k]:g} of value {k}."
        )
    return least, greatest


def check_axes(input_type: InputType, input_ref_frame: InputFrame) -> None:
    """Raise ValueError for absolute goals in axes that move with the goal."""
    if input_type == "absolute" and input_ref_frame == "eef":
        raise ValueError(
            "input_ref_frame 'eef' needs input_type 'delta': 'eef' is for steps, since "
            "a goal in the frame's own axes would move with it. Use 'base' or 'world'"
        )


def apply_torque_settings(law: Law, settings: PartSettings) -> None:
    """Set a law's torque limits, compensation and disturbance observer."""
    law.record["observer"] = settings.disturbance_observer
    law.record["compensation"] = float(settings.use_torque_compensation)
    if settings.torque_limits is not None:
        drives = law.drives
        own = drives["command_min"], drives["command_max"]
        low, high = narrowed(*own, settings.torque_limits, "torque_limits")
        drives["command_min"], drives["command_max"] = low, high


def damping_of(kp: Any, ratio: Any) -> Any:
    """Return kd, 1/s, of stiffnesses and damping ratios."""
    return 2.0 * ratio * kp**0.5
