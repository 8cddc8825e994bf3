"""Settings of the pipeline, one field per stage; None disables a stage."""

from typing import Literal

from pydantic import NonNegativeFloat, PositiveFloat, model_validator

from wbc_suite.config_files import FrozenModel

Point = tuple[float, float, float]


class RatesConfig(FrozenModel):
    """Limits of a target's derivatives, units / s, / s^2 and / s^3."""

    speed: PositiveFloat
    acceleration: PositiveFloat
    jerk: PositiveFloat


class WorkspaceBox(FrozenModel):
    """Box in which targets are kept, m, in the world.

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
    """How far a target may be ahead of its limb.

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
    """Settings of the stages between a device and the controller.

    Attributes:
        mode: `relative`: targets repeat the input's motion from where they are.
            `absolute`: targets are at the input's pose, in the world.
        scale: Motion of a target per motion of the input. In absolute mode, about the
            position of the limb at the reset.
        mirror: Swap left and right, for a user who faces the robot.
        jump: An input that moves further than this in one message, m, has lost track
            and is latched again; None follows all motion.
        jump_angle: The same for its rotation, rad.
        one_euro: Filter for a trembling input; None for none.
        workspace: Box in which targets are kept; None for no bound.
        leash: How far targets may be ahead; None for no bound.
        linear: Limits of positions, m.
        angular: Limits of orientations, rad.
        grip: Limits of grippers, whose values go from -1 to 1.
        fingers: What closes the robot's hand if a device tracks the user's: the
            vectors between the `tips` of the fingers, or `joints` where the robot's
            hand has no fingertips; the `joints` of each finger; or the `pinch` of
            thumb and index. None for nothing.
        joint: Limits of each joint that a device commands, rad or m.
        base_speed: Greatest speed of the base or the walk, m/s and rad/s; not more
            than the action permits.
        rise_speed: Greatest speed up and down of the body, m/s.
        base_rise: Limits of the derivatives of those speeds, m/s and rad/s.
        ramp: Time over which the permitted speed rises after a reset, s.
        hold_after: Time without new data after which limbs are held, s.
        return_after: Time without new data after which limbs move home, s; None for
            never: nobody may be watching then.
    """

    mode: Literal["relative", "absolute"] = "relative"
    scale: PositiveFloat = 1.0
    mirror: bool = False
    jump: PositiveFloat | None = 0.3
    jump_angle: PositiveFloat | None = 1.5
    one_euro: OneEuro | None = None
    workspace: WorkspaceBox | None = None
    leash: Leash | None = Leash()
    linear: RatesConfig = RatesConfig(speed=1.0, acceleration=10.0, jerk=300.0)
    angular: RatesConfig = RatesConfig(speed=3.0, acceleration=30.0, jerk=900.0)
    grip: RatesConfig = RatesConfig(speed=8.0, acceleration=80.0, jerk=2400.0)
    fingers: Literal["tips", "joints", "pinch"] | None = "tips"
    joint: RatesConfig = RatesConfig(speed=2.0, acceleration=15.0, jerk=450.0)
    base_speed: tuple[PositiveFloat, PositiveFloat] = (0.6, 1.0)
    rise_speed: PositiveFloat = 0.1
    base_rise: RatesConfig = RatesConfig(speed=2.0, acceleration=20.0, jerk=600.0)
    ramp: NonNegativeFloat = 2.0
    hold_after: PositiveFloat = 0.15
    return_after: PositiveFloat | None = None


DRAGGED = PipelineConfig(
    jump=None,
    jump_angle=None,
    leash=None,  # a target out of reach is reported instead; see `LimbTarget.settle`
    linear=RatesConfig(speed=2.0, acceleration=30.0, jerk=1500.0),
    angular=RatesConfig(speed=6.0, acceleration=90.0, jerk=4500.0),
    base_speed=(1.0, 1.0),
    ramp=0.0,
)
"""The pipeline of handles that a mouse drags, alone."""
