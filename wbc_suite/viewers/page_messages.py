"""The messages that a browser may send to viser: types, ranges and sizes.

viser sets any property of an element that a message names, keeps uploads to any
element in memory, and passes on whatever numbers it gets. So the proxy of `PageServer`
admits only the messages that its pages use, with finite numbers.
"""

from typing import Annotated, Literal, TypeAlias

import msgspec

MAX_BYTES = 16_384  # of a message; a browser sends less than 1 kB
LARGEST_NUMBER = 1e6  # greatest absolute value, in any unit

Number: TypeAlias = Annotated[
    float, msgspec.Meta(ge=-LARGEST_NUMBER, le=LARGEST_NUMBER)
]
Text: TypeAlias = Annotated[
    str, msgspec.Meta(max_length=256, pattern=r"\A[^\x00-\x1f\x7f-\x9f]*\Z")
]
"""Without control characters: viser prints errors about what it gets."""
Point: TypeAlias = tuple[Number, Number, Number]
Quaternion: TypeAlias = tuple[Number, Number, Number, Number]
Pixels: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=100_000)]


class _Message(msgspec.Struct, tag_field="type", tag=True, forbid_unknown_fields=True):
    """A message; its class has the name of viser's."""


class ViewerCameraMessage(_Message):
    """The camera of a client."""

    wxyz: Quaternion
    position: Point
    fov: Number
    near: Number
    far: Number
    image_height: Pixels
    image_width: Pixels
    look_at: Point
    up_direction: Point


class GuiUpdateMessage(_Message):
    """A new value of an element."""

    uuid: Text
    updates: dict[Literal["value"], bool | Number | Text]


class CommandTriggerMessage(_Message):
    """A hotkey."""

    uuid: Text


class TransformControlsDragStartMessage(_Message):
    """A handle is grabbed."""

    name: Text
    owner: Text = ""


class TransformControlsUpdateMessage(_Message):
    """A handle is dragged."""

    name: Text
    wxyz: Quaternion
    position: Point
    owner: Text = ""


class TransformControlsDragEndMessage(_Message):
    """A handle is released."""

    name: Text
    owner: Text = ""


_decoder = msgspec.msgpack.Decoder(
    ViewerCameraMessage
    | GuiUpdateMessage
    | CommandTriggerMessage
    | TransformControlsDragStartMessage
    | TransformControlsUpdateMessage
    | TransformControlsDragEndMessage
)


def is_valid(message: str | bytes) -> bool:
    """Return whether a page of ours sends such a message."""
    try:
        _decoder.decode(message if isinstance(message, bytes) else message.encode())
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return False
    return isinstance(message, bytes)
