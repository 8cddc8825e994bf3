"""Staged reward of bringing one object to a target: reach, grasp, lift, hover."""

import math

from pydantic import NonNegativeFloat, PositiveFloat, model_validator

from wbc_suite.config_files import FrozenModel


class StagedReward(FrozenModel):
    """Rewards of the stages, all below 1, and their scales, 1/m.

    Attributes:
        reach: Largest reward of a hand near the object.
        grasp: Reward of a grasp.
        lift: Largest reward of lifting.
        hover: Largest reward above the target.
        withdrawn: A hand has left a placed object if its reach term is less.
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
    def _rises_to_one(self) -> "StagedReward":
        if not self.reach <= self.grasp <= self.lift <= self.hover < 1.0:
            raise ValueError("stages must rise: reach <= grasp <= lift <= hover < 1")
        return self

    def has_left(self, distance: float) -> bool:
        """Whether a hand at a distance, m, has left the object."""
        return 1.0 - math.tanh(self.reach_scale * distance) < self.withdrawn

    def value(
        self,
        *,
        distance: float,
        grasped: bool,
        missing: float,
        aside: float,
        over: bool,
    ) -> float:
        """Return the reward of one object.

        The largest of

            reach (1 - tanh(reach_scale d))
            grasp + (lift - grasp) (1 - tanh(lift_scale m))             if grasped
            lift + (hover - lift) (1 - tanh(hover_scale a))             if over
            the lifting term + (hover - lift) (1 - tanh(hover_scale a)) if grasped

        An object over its target needs no grasp, so that letting it go costs nothing.

        Args:
            distance: Distance of the nearest hand, d, m.
            grasped: Whether a hand grasps the object.
            missing: Height below the goal of lifting, m >= 0, m.
            aside: Horizontal distance to the target, a, m.
            over: Whether the object is above its target.
        """
        reward = self.reach * (1.0 - math.tanh(self.reach_scale * distance))
        near = (self.hover - self.lift) * (1.0 - math.tanh(self.hover_scale * aside))
        if over:
            reward = max(reward, self.lift + near)
        if grasped:
            high = 1.0 - math.tanh(self.lift_scale * missing)
            lifted = self.grasp + (self.lift - self.grasp) * high
            reward = max(reward, lifted + near)
        return reward
