"""The messages that a browser may send to viser: types, ranges and sizes.

viser sets any property of an element that a message names, keeps uploads to any
element in memory, and passes on whatever numbers it gets. So the proxy of `PageServer`
admits only the messages that its pages use, with finite numbers.
"""

import functools
import operator
from typing import Annotated, Any, Literal, TypeAlias

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
HANDLE = {"name": Text, "owner": Text}  # what is grabbed, dragged or released


FIELDS: dict[str, dict[str, Any]] = {
    "ViewerCameraMessage": {  # the camera of a client
        "wxyz": Quaternion,
        "position": Point,
        "look_at": Point,
        "up_direction": Point,
        **dict.fromkeys(("fov", "near", "far"), Number),
        **dict.fromkeys(("image_height", "image_width"), Pixels),
    },
    "GuiUpdateMessage": {  # a new value of an element
        "uuid": Text,
        "updates": dict[Literal["value"], bool | Number | Text],
    },
    "CommandTriggerMessage": {"uuid": Text},  # a hotkey
    "TransformControlsDragStartMessage": HANDLE,
    "TransformControlsUpdateMessage": {"wxyz": Quaternion, "position": Point} | HANDLE,
    "TransformControlsDragEndMessage": HANDLE,
}
"""Types of the fields of each message, by viser's names."""

_MESSAGES = [
    msgspec.defstruct(
        name,
        [(n, kind, "") if n == "owner" else (n, kind) for n, kind in fields.items()],
        tag_field="type",
        tag=True,
        forbid_unknown_fields=True,
        kw_only=True,
    )
    for name, fields in FIELDS.items()
]
_decoder = msgspec.msgpack.Decoder(functools.reduce(operator.or_, _MESSAGES))


def is_valid(message: str | bytes) -> bool:
    """Return whether a page of ours sends such a message."""
    try:
        _decoder.decode(message if isinstance(message, bytes) else message.encode())
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return False
    return isinstance(message, bytes)
