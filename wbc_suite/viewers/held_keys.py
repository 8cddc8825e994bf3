"""Keys that are held on a page, told to the server by a script of ours.

viser reports presses of hotkeys, but neither that a key is held nor its release. So the
proxy adds a script to viser's page. It sends messages through a WebSocket of its own,
`[forward, left, turn, up]` with values -1 .. 1, while keys, buttons with an attribute
`data-drive` or sticks of a gamepad are held, every 0.1 s, and zeros once afterwards and
at the start. When the connection drops the script lets go of all of them. It connects
once there is such a button: a page that shows none drives nothing.
"""

import asyncio
import itertools
import json
from collections.abc import Callable

import numpy as np
from aiohttp import WSMsgType, web

from wbc_suite.typing import Vector

SOCKET = "/held_keys"
MAX_BYTES = 200  # of a message
HEARTBEAT = 6.0  # s; a page that is gone is disconnected after 1.5 times this
AXES = 4  # forward, left, turn, up

Receiver = Callable[[int, Vector | None], None]


class HeldKeys:
    """Receives what is held on the pages of a server, once `listen` was called.

    Clients are numbered -1, -2, ...; the other clients of a server have numbers from 0.
    """

    def __init__(self) -> None:
        self._receive: Receiver | None = None
        self._numbers = itertools.count(1)

    def listen(self, receive: Receiver) -> None:
        """Pass on what is held; until then clients are disconnected, and try again.

        Args:
            receive: Called with a client and its axes, shape (4,), -1 .. 1; with None
                when the client has gone.
        """
        self._receive = receive

    async def serve(self, request: web.Request) -> web.WebSocketResponse:
        """Receive what one client holds until it leaves."""
        socket = web.WebSocketResponse(
            max_msg_size=MAX_BYTES, heartbeat=HEARTBEAT, compress=False, timeout=1.0
        )
        await socket.prepare(request)
        receive, client = self._receive, -next(self._numbers)
        if receive is None:
            return socket
        try:  # in a thread: `receive` may wait for the control loop
            async for message in socket:
                axes = parse_axes(message.data)
                if message.type is not WSMsgType.TEXT or axes is None:
                    break
                await asyncio.to_thread(receive, client, axes)
        finally:
            await asyncio.to_thread(receive, client, None)
        return socket


def parse_axes(text: str | bytes) -> Vector | None:
    """Return the axes of a message, shape (4,), -1 .. 1; None if it is invalid."""
    try:
        axes = np.array(json.loads(text), dtype=np.float64)
    except (ValueError, TypeError):
        return None
    if axes.shape != (AXES,) or not np.isfinite(axes).all():
        return None
    return np.clip(axes, -1.0, 1.0)
