"""Random and hostile messages to page, stream and headset, with a viewer watching.

The loop must neither stop nor stall, the viewer must keep its connection, and memory
must not grow.
"""

import contextlib
import json
import math
import os
import random
import re
import time
from pathlib import Path

import msgspec
import numpy as np
import pytest
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from tests.viewers.fake_env import FakeEnv
from wbc_suite.cli.teleop import stages_of
from wbc_suite.devices.headset import Headset
from wbc_suite.devices.stream import Stream
from wbc_suite.viewers.page_process import PageProcess
from wbc_suite.viewers.teleop_session import TeleopSession

MESSAGES = int(os.environ.get("WBC_SUITE_MESSAGES", "10000"))
PATIENCE = 60.0  # s, after which the loop has stopped
VALUES = (0, 1, -1, 0.5, 1e6, 1e300, math.nan, math.inf, -math.inf, "a", None, [], {})
TYPES = (
    "ViewerCameraMessage",
    "GuiUpdateMessage",
    "CommandTriggerMessage",
    "TransformControlsDragStartMessage",
    "TransformControlsUpdateMessage",
    "TransformControlsDragEndMessage",
    "FileTransferStartUpload",
    "FileTransferPart",
    "GuiFormSubmitMessage",
    "SceneNodeClickMessage",
    "ShareUrlRequest",
    "nonsense",
)
FIELDS = ("name", "owner", "uuid", "position", "wxyz", "updates", "fov", "near")


def vector(rng, size):
    return [rng.choice(VALUES) for _ in range(size)]


def page_message(rng):
    """Return a message of viser's shape, of any quality, or bytes."""
    if rng.random() < 0.1:
        return rng.randbytes(rng.randrange(200))
    message = {"type": rng.choice(TYPES), "name": "/gizmos/right_hand", "owner": "0"}
    if rng.random() < 0.8:
        message |= {"wxyz": vector(rng, 4), "position": vector(rng, 3)}
    for field in rng.sample(FIELDS, rng.randrange(4)):
        message[field] = rng.choice((*VALUES, {"value": rng.choice(VALUES)}))
    return msgspec.msgpack.encode(message)


def frame(rng, index):
    """Return a pose frame, of any quality, or text."""
    if rng.random() < 0.1:
        return rng.choice(("", "[", "null", "[" * 2000, '{"a":1}', "\x00"))
    limb = {"pose": {"position": vector(rng, 3), "orientation": vector(rng, 4)}}
    limb |= {"twist": vector(rng, 6), "grip": rng.choice(VALUES)}
    limb["fingers"] = [vector(rng, 3) for _ in range(rng.choice((0, 1, 25, 26)))]
    limb = {name: limb[name] for name in limb if rng.random() < 0.5}
    content = {"format": "wbc-pose-frame/1", "time": 0.01 * index}
    content |= {"limbs": {rng.choice(("right", "left", "hand", "head")): limb}}
    if rng.random() < 0.3:
        content[rng.choice(("base", "height", "buttons", "x"))] = vector(rng, 3)
    return json.dumps(content)


class Attacker:
    """A client that connects again whenever it is disconnected."""

    def __init__(self, address, **options):
        self._address, self._options, self._socket = address, options, None
        self.connections = 0

    def send(self, message):
        with contextlib.suppress(ConnectionClosed, OSError):
            if self._socket is None or self._socket.protocol.state.name != "OPEN":
                self._socket = connect(self._address, max_size=None, **self._options)
                self.connections += 1
            self._socket.send(message)


class TimedEnv(FakeEnv):
    """Notes when it is stepped."""

    def __init__(self):
        super().__init__()
        self.times = []

    def step(self, action):
        self.times.append(time.monotonic())
        return super().step(action)


def tick_after(session, tick):
    """Wait for another tick of the loop, and return its number."""
    deadline = time.monotonic() + PATIENCE
    while session.snapshot.tick <= tick:
        assert time.monotonic() < deadline, f"the loop stands at tick {tick}"
        time.sleep(0.001)
    return session.snapshot.tick


def megabytes(pid):
    """Return what a process has in memory."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmRSS:\s*(\d+)", status)[1]) / 1024


@pytest.mark.sample(1)
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["stream", "headset"])
def test_ten_thousand_messages_stop_neither_the_loop_nor_a_viewer(kind):
    device = {"stream": Stream, "headset": Headset}[kind](port=0)
    env = TimedEnv()
    session = TeleopSession(
        env,
        period=0.02,
        device=device,
        pipeline=stages_of(kind, scale=1.0, mirror=False),
    )
    page = PageProcess("127.0.0.1", 0, label="test")
    page.attach(session)
    device.start()
    session.start()
    options = {"subprotocols": [Subprotocol(f"viser-v{viser.__version__}")]}
    address = page.url.rstrip("/").replace("http", "ws")
    viewer = connect(address, max_size=None, **options)
    page_attacker = Attacker(address, **options)
    attacker = Attacker(device.url.rstrip("/").replace("http", "ws") + "/frames")
    rng, before, ticks = random.Random(0), megabytes(os.getpid()), [0]
    for index in range(MESSAGES // 2):
        page_attacker.send(page_message(rng))
        attacker.send(frame(rng, index))
        if index % (MESSAGES // 20) == 0:
            ticks.append(tick_after(session, ticks[-1]))
    try:
        assert session.running
        assert page_attacker.connections > 20  # most messages ended a connection
        assert np.isfinite(env.actions).all()
        viewer.ping().wait(10.0)
        assert viewer.protocol.state.name == "OPEN"
        page.check()
        grown = megabytes(os.getpid()) - before
        print(
            f"{ticks[-1]} ticks, at most "
            f"{1e3 * np.diff(env.times).max():.0f} ms apart; the page has "
            f"{megabytes(page.pid):.0f} MB, the loop {grown:.0f} MB more"
        )
        assert megabytes(page.pid) < 1000
        assert grown < 100
    finally:
        session.stop()
        page.stop()
        device.stop()
