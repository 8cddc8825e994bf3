"""Pose frames: the JSON messages that headsets, phones and leader arms send."""

from typing import Annotated, Literal

import numpy as np
import pinocchio as pin
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from wbc_suite.devices.state import DeviceState, LimbInput
from wbc_suite.errors import DeviceError

FORMAT = "wbc-pose-frame/1"
MAX_BYTES = 32_768
"""Maximum size of a frame; two hands with all their joints take 4 kB."""
MAX_BUTTONS = 32

FAR = 1e6
"""Greatest absolute value of a number in a frame, in any unit."""

Number = Annotated[float, Field(ge=-FAR, le=FAR)]
Point = tuple[Number, Number, Number]
Name = Annotated[str, Field(min_length=1, max_length=64)]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Pose(_Model):
    """A pose in a fixed frame: x forward, y left, z up.

    Attributes:
        position: m.
        orientation: Unit quaternion, w x y z.
    """

    position: Point
    orientation: tuple[Number, Number, Number, Number]

    @field_validator("orientation")
    @classmethod
    def _is_rotation(cls, quat: tuple[float, ...]) -> tuple[float, ...]:
        if abs(float(np.linalg.norm(quat)) - 1.0) > 1e-2:
            raise ValueError("a quaternion w x y z has length 1")
        return quat

    def se3(self) -> pin.SE3:
        """Return the pose as `pin.SE3`."""
        w, x, y, z = self.orientation
        return pin.SE3(pin.Quaternion(w, x, y, z).normalized(), np.array(self.position))


class PoseLimb(_Model):
    """Input for one limb; absent fields give no input.

    Attributes:
        pose: Pose of the wrist or the head.
        twist: Velocity in axes of the world, m/s and rad/s.
        engaged: Whether the robot's limb follows.
        grip: Closing of the hand, -1 open .. 1 closed: one value, or one per synergy.
        fingers: Positions of the hand's 25 joints, m, in the order of WebXR.
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
        return LimbInput(
            pose=None if self.pose is None else self.pose.se3(),
            twist=None if self.twist is None else np.array(self.twist),
            engaged=self.engaged,
            grip=None if self.grip is None else np.array(self.grip),
            fingers=None if self.fingers is None else np.array(self.fingers),
        )


class PoseFrame(_Model):
    """State of a device at one moment.

    Attributes:
        format: Version of the format.
        time: On the sender's clock, s; it must increase from frame to frame.
        limbs: By limb: `head`, `right` and `left` for the wrists, `hand` for the
            selected one, or a slice of the action.
        joints: Positions by joint, rad or m, as a leader arm has them.
        base: Velocity of the base: forward and left, m/s, and turn, rad/s.
        height: Velocity of the torso's height, m/s.
        buttons: Pressed buttons: `grip` (closes or opens the gripper of the selected
            hand), `next`, `mirror`, `home`, `pause`, `reset`, `quit`, `keep`,
            `discard`, `undo`, `success`. One frame is enough.
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
            time=self.time,
            limbs={name: limb.limb_input() for name, limb in self.limbs.items()},
            joints=self.joints,
            base=None if self.base is None else np.array(self.base),
            height=self.height,
            buttons=frozenset(self.buttons),
        )


def frame_schema() -> dict[str, object]:
    """Return the JSON Schema of a pose frame."""
    return PoseFrame.model_json_schema()
