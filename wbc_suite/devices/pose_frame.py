"""Pose frames: the JSON messages that headsets, phones and leader arms send."""

from typing import Annotated, Literal

import numpy as np
import pinocchio as pin
from pydantic import Field, ValidationError, field_validator

from wbc_suite.config_files import FrozenModel
from wbc_suite.devices.state import DeviceState, LimbInput
from wbc_suite.errors import DeviceError

MAX_BYTES = 32_768
"""Maximum size of a frame; two hands with all their joints take 4 kB."""
MAX_BUTTONS = 32  # of a frame; more than any controller has

LARGEST_NUMBER = 1e6
"""Greatest absolute value of a number in a frame, in any unit."""

Number = Annotated[float, Field(ge=-LARGEST_NUMBER, le=LARGEST_NUMBER)]
Point = tuple[Number, Number, Number]
Name = Annotated[str, Field(min_length=1, max_length=64)]


class Pose(FrozenModel):
    """A pose in a fixed frame, x forward, y left, z up: m, and a quaternion w x y z."""

    position: Point
    orientation: tuple[Number, Number, Number, Number]

    @field_validator("orientation")
    @classmethod
    def _is_rotation(cls, quat: tuple[float, ...]) -> tuple[float, ...]:
        if abs(float(np.linalg.norm(quat)) - 1.0) > 1e-2:
            raise ValueError("a quaternion w x y z must have length 1")
        return quat

    def se3(self) -> pin.SE3:
        """Return the pose as `pin.SE3`."""
        w, x, y, z = self.orientation
        return pin.SE3(pin.Quaternion(w, x, y, z).normalized(), np.array(self.position))


class PoseLimb(FrozenModel):
    """Input for one limb, see `LimbInput`; absent fields give no input.

    The pose is that of the wrist or the head.
    """

    pose: Pose | None = None
    twist: tuple[Number, Number, Number, Number, Number, Number] | None = None
    engaged: bool = True
    grip: Number | list[Number] | None = Field(default=None)
    fingers: list[Point] | None = Field(default=None, min_length=25, max_length=25)

    @field_validator("grip")
    @classmethod
    def _is_short(cls, grip: float | list[float] | None) -> float | list[float] | None:
        if isinstance(grip, list) and not 1 <= len(grip) <= 32:
            raise ValueError("one value, or one for each of at most 32 synergies")
        return grip

    def limb_input(self) -> LimbInput:
        """Return the input as the pipeline reads it."""
        pose = None if self.pose is None else self.pose.se3()
        return LimbInput(pose=pose, **self.model_dump(exclude={"pose"}))


class PoseFrame(FrozenModel):
    """State of a device at one moment.

    Attributes:
        format: Version of the format.
        time: On the sender's clock, s; it must increase from frame to frame.
        limbs: By limb: `head`, `right` and `left` for the wrists, `hand` for the
            selected one, or a slice of the action.
        joints, base, height, buttons: See `DeviceState`. One frame with a pressed
            button is enough.
    """

    format: Literal["wbc-pose-frame/1"]
    time: Number
    limbs: dict[Name, PoseLimb] = Field(default={}, max_length=32)
    joints: dict[Name, Number] = Field(default={}, max_length=128)
    base: Point | None = None
    height: Number = 0.0
    buttons: list[Name] = Field(default=[], max_length=MAX_BUTTONS)

    @classmethod
    def parse(cls, text: str | bytes) -> "PoseFrame":
        """Parse a frame.

        Raises:
            DeviceError: If it is invalid; names the field and the error.
        """
        if len(text) > MAX_BYTES:
            raise DeviceError(f"A frame has at most {MAX_BYTES} bytes.")
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            first = error.errors(include_url=False, include_input=False)[0]
            where = ".".join(str(key)[:64] for key in first["loc"]) or "frame"
            raise DeviceError(f"Pose frame: {where}: {first['msg']}.") from error

    def state(self) -> DeviceState:
        """Return the state that the frame describes."""
        return DeviceState(
            limbs={name: limb.limb_input() for name, limb in self.limbs.items()},
            buttons=frozenset(self.buttons),
            **self.model_dump(include={"time", "joints", "base", "height"}),
        )
