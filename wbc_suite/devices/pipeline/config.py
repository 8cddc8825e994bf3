"""The switches of the pipeline: one field per stage, None where it may be off."""

from typing import Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from wbc_suite.devices.pipeline.motion_limit import Rates
from wbc_suite.tomlfile import FrozenModel

__all__ = ["Leash", "OneEuro", "PipelineConfig", "RatesConfig", "WorkspaceBox"]

Point = tuple[float, float, float]


class RatesConfig(FrozenModel):
    """Greatest derivatives of a target, in units / s, / s^2 and / s^3."""

    speed: PositiveFloat
    acceleration: PositiveFloat
    jerk: PositiveFloat

    @property
    def rates(self) -> Rates:
        """The same as a plain value."""
        return Rates(self.speed, self.acceleration, self.jerk)


class WorkspaceBox(FrozenModel):
    """Where targets may be, m, in the world.

    Attributes:
        low: Least coordinates.
        high: Greatest coordinates.
    """

    low: Point
    high: Point

    @model_validator(mode="after")
    def _check(self) -> "WorkspaceBox":
        if any(a >= b for a, b in zip(self.low, self.high, strict=True)):
            raise ValueError("low must be below high in each coordinate")
        return self


class Leash(FrozenModel):
    """How far a target may lead the limb.

    Attributes:
        distance: m.
        angle: rad.
    """

    distance: PositiveFloat = 0.25
    angle: PositiveFloat = 1.0


class OneEuro(FrozenModel):
    """A low-pass filter whose cutoff rises with speed.

    Attributes:
        cutoff: Cutoff at rest, Hz.
        linear_rise: By how much it rises with speed, Hz per m/s.
        angular_rise: By how much it rises with angular speed, Hz per rad/s.
    """

    cutoff: PositiveFloat = 2.0
    linear_rise: NonNegativeFloat = 60.0
    angular_rise: NonNegativeFloat = 15.0


class PipelineConfig(FrozenModel):
    """What happens between a device and the controller.

    Attributes:
        mode: `relative`: targets repeat the input's motions from where they are.
            `absolute`: targets are where the input is, in the world.
        scale: Motion of a target per motion of the input. In absolute mode, about the
            place where the limb was at the start.
        mirror: Swap left and right, as for a person who faces the robot.
        jump: An input that moves further than this in one message, m, has lost track
            and is latched anew; None takes everything as motion.
        one_euro: Smoothing of a trembling input; None for none.
        workspace: Where targets may be; None for anywhere.
        leash: How far targets may lead; None for any distance.
        linear: Limits of positions, m.
        angular: Limits of orientations, rad.
        grip: Limits of grippers, whose values go from -1 to 1.
        fingers: What closes the robot's hand, when a device sees the person's: the
            `joints` of each finger, or the `pinch` of thumb and index; None for
            neither.
        joint: Limits of joints that a device places, rad or m, each for itself.
        base_speed: Greatest speed of the base, m/s and rad/s.
        base_rise: Limits of that speed's own changes, m/s and rad/s.
        ramp: Time over which speeds rise to their limits after a start, s.
        hold_after: A device that says nothing new for so long is let go of, s.
        return_after: And after so long limbs go back to where they started, s; None
            for never.
    """

    mode: Literal["relative", "absolute"] = "relative"
    scale: PositiveFloat = 1.0
    mirror: bool = False
    jump: PositiveFloat | None = 0.3
    one_euro: OneEuro | None = None
    workspace: WorkspaceBox | None = None
    leash: Leash | None = Leash()
    linear: RatesConfig = RatesConfig(speed=1.0, acceleration=10.0, jerk=300.0)
    angular: RatesConfig = RatesConfig(speed=3.0, acceleration=30.0, jerk=900.0)
    grip: RatesConfig = RatesConfig(speed=8.0, acceleration=80.0, jerk=2400.0)
    fingers: Literal["joints", "pinch"] | None = "joints"
    joint: RatesConfig = RatesConfig(speed=2.0, acceleration=15.0, jerk=450.0)
    base_speed: tuple[PositiveFloat, PositiveFloat] = (0.6, 1.0)
    base_rise: RatesConfig = RatesConfig(speed=2.0, acceleration=20.0, jerk=600.0)
    ramp: NonNegativeFloat = 2.0
    hold_after: PositiveFloat = 0.15
    return_after: PositiveFloat | None = Field(default=10.0)
