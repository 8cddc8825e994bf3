"""Keys that are held on a page, told to the server by a script of ours.

viser reports presses of hotkeys, but neither that a key is held nor its release. So the
proxy adds a script to viser's page. It sends messages through a WebSocket of its own,
`[forward, left, turn, up]` with values -1 .. 1, while keys, buttons with an attribute
`data-drive` or sticks of a gamepad are held, every 0.1 s, and zeros once afterwards and
at the start. When the connection drops the script lets go of all of them.
"""

import asyncio
import itertools
import json
from collections.abc import Callable
from importlib import resources

import numpy as np
from aiohttp import WSMsgType, hdrs, web

from wbc_suite.typing import Vector

SCRIPT, SOCKET = "/held_keys.js", "/held_keys"
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

    @property
    def routes(self) -> list[web.AbstractRouteDef]:
        """Routes of the script and of its WebSocket."""
        return [web.get(SCRIPT, self._send_script), web.get(SOCKET, self._serve)]

    def listen(self, receive: Receiver) -> None:
        """Add the script to pages, and pass on what it sends.

        Args:
            receive: Called with a client and its axes, shape (4,), -1 .. 1; with None
                when the client has gone.
        """
        self._receive = receive

    def add_script(self, page: bytes) -> bytes:
        """Return a page of HTML with the script, before all others."""
        if self._receive is None:
            return page
        tag = f'<head><script src="{SCRIPT}"></script>'
        return page.replace(b"<head>", tag.encode(), 1)

    async def _send_script(self, _: web.Request) -> web.Response:
        script = resources.files("wbc_suite.viewers") / "pages" / "held_keys.js"
        return web.Response(
            text=script.read_text("utf-8"),
            content_type="text/javascript",
            headers={hdrs.CACHE_CONTROL: "no-store"},
        )

    async def _serve(self, request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse(
            max_msg_size=MAX_BYTES, heartbeat=HEARTBEAT, compress=False, timeout=1.0
        )
        await socket.prepare(request)
        client = -next(self._numbers)
        try:
            async for message in socket:
                axes = parse_axes(message.data)
                if message.type is not WSMsgType.TEXT or axes is None:
                    break
                await self._pass_on(client, axes)
        finally:
            await self._pass_on(client, None)
        return socket

    async def _pass_on(self, client: int, axes: Vector | None) -> None:
        if self._receive is not None:  # in a thread: it may wait for the control loop
            await asyncio.to_thread(self._receive, client, axes)


def parse_axes(text: str | bytes) -> Vector | None:
    """Return the axes of a message, shape (4,), -1 .. 1; None if it is invalid."""
    try:
        axes = np.array(json.loads(text), dtype=np.float64)
    except (ValueError, TypeError):
        return None
    if axes.shape != (AXES,) or not np.isfinite(axes).all():
        return None
    return np.clip(axes, -1.0, 1.0)
