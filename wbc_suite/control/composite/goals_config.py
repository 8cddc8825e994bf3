"""What configs of whole-body controllers have in common: goals of frames."""

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from wbc_suite.control.composite.whole_body_config import (
        ControlledFrame,
        InputFrame,
        InputType,
    )


class GoalsConfig(Protocol):
    """Controlled frames, and how an action moves their goals.

    Attributes:
        frames: Controlled frames, in the order of the action.
        input_type: `absolute` targets, or `delta` steps from the last target.
        input_ref_frame: Axes of targets and steps: `world`, the robot's `base`, or the
            controlled frame's own (`eef`, deltas only).
        delta_position: Largest step of a delta action, m.
        delta_rotation: Largest step of a delta action, rad.
    """

    @property
    def frames(self) -> "tuple[ControlledFrame, ...]":
        """Controlled frames."""
        ...

    @property
    def input_type(self) -> "InputType":
        """What an action is."""
        ...

    @property
    def input_ref_frame(self) -> "InputFrame":
        """Axes of actions."""
        ...

    @property
    def delta_position(self) -> float:
        """Largest step, m."""
        ...

    @property
    def delta_rotation(self) -> float:
        """Largest step, rad."""
        ...


def check_goals(config: GoalsConfig) -> None:
    """Raise ValueError where frames share a name, or axes do not fit the input."""
    names = [frame.name for frame in config.frames]
    if len(set(names)) != len(names):
        raise ValueError(f"controlled frames share a name: {names}")
    if config.input_type == "absolute" and config.input_ref_frame == "eef":
        raise ValueError(
            "input_ref_frame 'eef' needs input_type 'delta': a frame is always at the "
            "origin of its own axes"
        )
