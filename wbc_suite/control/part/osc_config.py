"""Config of OSC_POSE and OSC_POSITION."""

from typing import Literal

import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat, model_validator

from wbc_suite.control.part.config import InputFrame, InputType, Numbers, Span
from wbc_suite.control.part.impedance import Gains, ImpedanceSettings

__all__ = ["OscConfig"]

STEP = (0.05, 0.05, 0.05, 0.5, 0.5, 0.5)
"""m and rad; steps of a full action, which are those of this field's data sets."""


class OscConfig(ImpedanceSettings):
    """The hand follows poses in operational space; see `OscLaw`.

    Critically damped, a step is within 2 % of its end after `5.83 / sqrt(kp)` seconds:
    0.29 s at the default of 400 /s^2, unless a joint reaches its top speed on the way.

    Attributes:
        type: `OSC_POSE`, or `OSC_POSITION`, which holds the orientation that the hand
            has at the start.
        kp: Stiffness, 1/s^2, for all axes or each: linear then angular, in both types.
        input_type: `delta` steps, see `goal_update_mode`, or `absolute` goals.
        input_ref_frame: Axes of the input: those of the world; of the robot's first
            link, with which goals move; or of the hand's goal, for deltas only.
        output_min: Step at `input_min`, m and rad.
        output_max: Step at `input_max`, m and rad.
        position_limits: Least and greatest coordinates of goals in the reference, m.
        orientation_limits: Least and greatest components of the rotation vector from
            the orientation at the start to a goal's, axes of the reference, rad.
        velocity_limits: Greatest speeds that the law asks for, m/s and rad/s.
        saturation: What gives when joints are at limits of torque or speed: each by
            itself (`clip`), or the length of the hand's acceleration rather than its
            direction (`qp`); see `OscLaw.straightened`.
        posture: Joint positions that the arm tends to where the hand leaves it free;
            those at the start for joints that are not named.
        posture_kp: Stiffness of that, 1/s^2, critically damped.
    """

    type: Literal["OSC_POSE", "OSC_POSITION"] = "OSC_POSE"
    kp: Gains = 400.0
    kp_limits: tuple[Gains, Gains] = (0.0, 500.0)
    input_type: InputType = "delta"
    input_ref_frame: InputFrame = "base"
    output_min: Numbers = tuple(-x for x in STEP)
    output_max: Numbers = STEP
    position_limits: Span | None = None
    orientation_limits: Span | None = None
    velocity_limits: tuple[PositiveFloat, PositiveFloat] | None = None
    saturation: Literal["clip", "qp"] = "qp"
    posture: dict[str, float] = {}
    posture_kp: NonNegativeFloat = 10.0

    @model_validator(mode="after")
    def _check(self) -> "OscConfig":
        if self.input_type == "absolute" and self.input_ref_frame == "eef":
            raise ValueError(
                "input_ref_frame 'eef' is for input_type 'delta': a goal that is given "
                "in the hand's own axes would move with the hand. Use 'base' or 'world'"
            )
        return self

    @property
    def size(self) -> int:
        """How many values of the action move the goal."""
        return 6 if self.type == "OSC_POSE" else 3

    def outputs(self) -> tuple[Numbers, Numbers]:
        """Return the steps at `input_min` and `input_max`, those of this type."""
        low, high = self.output_min, self.output_max
        if self.size == 3:  # without the angular ones, which may be given
            low, high = (tuple(np.atleast_1d(x)[:3].tolist()) for x in (low, high))
        return low, high
