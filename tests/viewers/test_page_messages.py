"""Which messages of browsers are admitted; viser would take all of them."""

import math

import msgspec
import pytest
import viser._messages as viser_messages

from wbc_suite.viewers import page_messages
from wbc_suite.viewers.page_messages import is_valid

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1, 0.0, 0.0, 0.0),
    "position": (2.0, 0, 1.5),
    "fov": 1.0,
    "near": 0.01,
    "far": 1000,
    "image_height": 600,
    "image_width": 960,
    "look_at": (0.0, 0.0, 1.0),
    "up_direction": (0.0, 0.0, 1.0),
}
HANDLE = {"name": "/gizmos/right_hand", "owner": "0"}
DRAG = {"position": [0.1, 0.2, 1], "wxyz": [1, 0, 0, 0.0]}
UPDATE = {"type": "TransformControlsUpdateMessage"} | HANDLE
GUI = {"type": "GuiUpdateMessage", "uuid": "a"}
PAGES_SEND = [
    CAMERA,
    UPDATE | DRAG,
    HANDLE | {"type": "TransformControlsDragStartMessage"},
    HANDLE | {"type": "TransformControlsDragEndMessage"},
    GUI | {"updates": {"value": 0.5}},
    GUI | {"updates": {"value": True}},
    GUI | {"updates": {"value": "Pause"}},
    {"type": "CommandTriggerMessage", "uuid": "a"},
]
HOSTILE = [
    *(UPDATE | DRAG | {"position": [x, 0, 0]} for x in (math.nan, math.inf, 1e300)),
    UPDATE | DRAG | {"wxyz": [math.nan, 0, 0, 0]},
    UPDATE | DRAG | {"wxyz": [1, 0]},
    UPDATE | {"position": "here", "wxyz": None},
    UPDATE,
    *(GUI | {"updates": {"value": x}} for x in (math.nan, -math.inf, "x" * 10_000, [])),
    *(GUI | {"updates": {"value": x}} for x in ("\x1b[2J", "\x9b1m", "a\nb", "\x00")),
    UPDATE | DRAG | {"name": "/gizmos/\x1b[2J"},
    *(GUI | {"updates": {name: 0}} for name in ("sync_cb", "update_cb", "removed")),
    CAMERA | {"position": (0, math.nan, 0)},
    CAMERA | {"image_height": -1},
    {"type": "FileTransferStartUpload", "source_component_uuid": "a"},
    {"type": "ShareUrlRequest"},
    {"type": "nonsense"},
    {"type": 3},
    {},
    [],
    None,
]


@pytest.mark.parametrize("message", PAGES_SEND)
def test_what_pages_send_is_admitted(message):
    assert is_valid(msgspec.msgpack.encode(message))


@pytest.mark.parametrize("message", HOSTILE)
def test_what_no_page_sends_is_refused(message):
    assert not is_valid(msgspec.msgpack.encode(message))


@pytest.mark.parametrize(
    "message",
    [b"", b"\xff", b"text", "text", b"\x91" * 10_000, b"\xdd\xff\xff\xff\xff"],
)
def test_what_is_no_message_is_refused(message):
    assert not is_valid(message)


def test_messages_have_the_fields_of_viser():
    """A new version of viser that renames one would lock every page out."""
    for message in PAGES_SEND:
        theirs = getattr(viser_messages, message["type"]).__dataclass_fields__
        assert page_messages.FIELDS[message["type"]].keys() == set(theirs)
