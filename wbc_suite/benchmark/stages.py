"""The reward of bringing one thing somewhere: reach, grasp, lift, hover."""

import math

from pydantic import NonNegativeFloat, PositiveFloat, model_validator

from wbc_suite.tomlfile import FrozenModel

__all__ = ["Stages"]


class Stages(FrozenModel):
    """Numbers of a staged reward, all below 1.

    Attributes:
        reach: At most, for a hand that comes near.
        grasp: For a hand that holds it.
        lift: At most, for lifting it.
        hover: At most, for bringing it above its target.
        reach_scale: 1/m.
        lift_scale: 1/m.
        hover_scale: 1/m.
        withdrawn: A hand has left what it has put down if its reach term is less.
    """

    reach: NonNegativeFloat
    grasp: NonNegativeFloat
    lift: NonNegativeFloat
    hover: NonNegativeFloat
    reach_scale: PositiveFloat
    lift_scale: PositiveFloat
    hover_scale: PositiveFloat
    withdrawn: PositiveFloat

    @model_validator(mode="after")
    def _rises_to_one(self) -> "Stages":
        if not self.reach <= self.grasp <= self.lift <= self.hover < 1.0:
            raise ValueError("stages rise: reach <= grasp <= lift <= hover < 1")
        return self

    def has_left(self, distance: float) -> bool:
        """Whether a hand at a distance, m, has let a thing go."""
        return 1.0 - math.tanh(self.reach_scale * distance) < self.withdrawn

    def reward(
        self,
        *,
        distance: float,
        grasped: bool,
        missing: float,
        aside: float,
        over: bool,
    ) -> float:
        """Return the reward for one thing.

        The largest of

            reach (1 - tanh(reach_scale d))
            grasp + (lift - grasp) (1 - tanh(lift_scale m))             if grasped
            from + (hover - lift) (1 - tanh(hover_scale a))             if grasped

        where `from` is `lift` over the target, and what lifting brought elsewhere.

        Args:
            distance: Of the nearest hand, d, m.
            grasped: Whether a hand holds the thing.
            missing: Height that is missing to the lift's goal, m >= 0, m.
            aside: Horizontal distance to the target, a, m.
            over: Whether the thing is above its target.
        """
        reward = self.reach * (1.0 - math.tanh(self.reach_scale * distance))
        if not grasped:
            return reward
        high = 1.0 - math.tanh(self.lift_scale * missing)
        lifted = self.grasp + (self.lift - self.grasp) * high
        near = 1.0 - math.tanh(self.hover_scale * aside)
        start = max(self.lift, lifted) if over else lifted
        return max(reward, start + (self.hover - self.lift) * near)
