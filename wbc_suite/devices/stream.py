"""The stream: pose frames over WebSocket, and the page that sends them."""

import asyncio
import contextlib
import json
import math
import ssl
import threading
import time
from dataclasses import replace
from http import HTTPStatus

from aiohttp import WSCloseCode, WSMsgType, web

from wbc_suite.devices.pose_frame import MAX_BUTTONS, MAX_BYTES, PoseFrame
from wbc_suite.devices.state import DeviceState
from wbc_suite.errors import DeviceError
from wbc_suite.web.certificate import installation_certificate, server_context
from wbc_suite.web.server import WebServer, page_url, send_file, token_for

SOCKET = "/frames"
SENDERS = 8  # connected at a time; only one of them moves the robot
FLOOD = 2000  # messages in a second that end a connection; a headset sends 90
HEARTBEAT = 6.0  # s; a sender that is gone is disconnected after 1.5 times this
HOLD = 1.0  # s; a sender without a valid frame for so long gives way to another one
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "connect-src 'self'"
)


class Stream:
    """A device that listens: the first client that sends a frame moves the robot.

    It listens on 127.0.0.1 by default; on any other address clients need a token. Port
    0 is any free one. `tls` encrypts with the certificate of this installation.

    Attributes:
        token: Secret that clients need; None on a loopback address.
        refused: Why the last invalid frame was refused.
    """

    def __init__(
        self, host: str = "127.0.0.1", port: int = 8090, *, tls: bool = False
    ) -> None:
        self._host, self._port, self._tls = host, port, tls
        self.token = token_for(host)
        self.refused = ""
        self._lock = threading.Lock()
        self._newest: PoseFrame | None = None
        self._pressed: set[str] = set()
        self._state = DeviceState(time=0.0)
        self._holder: web.WebSocketResponse | None = None
        self._heard: dict[web.WebSocketResponse, float] = {}
        """All senders, and when each sent its last valid frame, monotonic, s."""
        self._closing: set[asyncio.Task[None]] = set()
        self._server: WebServer | None = None

    @property
    def url(self) -> str:
        """The address of the pages; frames go to `/frames` there."""
        scheme = "https" if self._tls else "http"
        return page_url(self._host, self._port, self.token, scheme=scheme)

    @property
    def help(self) -> str:
        """What to print for the user."""
        return f"Stream: open {self.url} in a browser, or send pose frames.\n"

    def start(self) -> None:
        """Listen; for errors see `WebServer` and `server_context`."""
        self._server = WebServer(
            self._host,
            self._port,
            self._routes(),
            token=self.token,
            tls=self._tls_context(),
        )
        self._port = self._server.port

    def _routes(self) -> list[web.RouteDef]:
        """Return what is served."""
        return [web.get("/", self._send_page), web.get(SOCKET, self._receive)]

    def _tls_context(self) -> ssl.SSLContext | None:
        """Return the server side of TLS; None for plain HTTP."""
        return server_context(*installation_certificate()) if self._tls else None

    def read(self) -> DeviceState:
        """Return the newest frame, with all buttons pressed since the last read."""
        with self._lock:
            newest, self._newest = self._newest, None
            pressed, self._pressed = self._pressed, set()
        if newest is not None:
            self._state = replace(newest.state(), buttons=frozenset(pressed))
        return self._state

    def stop(self) -> None:
        """Close the port and every connection."""
        if self._server is not None:
            self._server.stop()

    async def _send_page(self, _: web.Request) -> web.Response:
        return send_file("devices/pages", "controls.html", policy=POLICY)

    async def _receive(self, request: web.Request) -> web.StreamResponse:
        """Keep the newest frame of the sender that moves the robot."""
        if len(self._heard) >= SENDERS and not self._make_room():
            return web.Response(
                status=HTTPStatus.SERVICE_UNAVAILABLE, text="Too many senders."
            )
        sender = web.WebSocketResponse(
            max_msg_size=MAX_BYTES, heartbeat=HEARTBEAT, compress=False, timeout=1.0
        )
        await sender.prepare(request)
        self._heard[sender] = -math.inf
        try:
            await self._receive_frames(sender)
        finally:
            self._forget(sender)
        return sender

    def _make_room(self) -> bool:
        """Disconnect the sender that is silent for longest; False if none is silent."""
        silent = min(self._heard, key=self._heard.__getitem__)
        if time.monotonic() - self._heard[silent] < HOLD:
            return False
        self._forget(silent)
        closing = asyncio.create_task(_give_way(silent))
        self._closing.add(closing)
        closing.add_done_callback(self._closing.discard)
        return True

    def _forget(self, sender: web.WebSocketResponse) -> None:
        self._heard.pop(sender, None)
        if self._holder is sender:
            self._holder = None

    async def _receive_frames(self, sender: web.WebSocketResponse) -> None:
        began, count = time.monotonic(), 0
        async for message in sender:
            now, count = time.monotonic(), count + 1
            if now - began > 1.0:
                began, count = now, 0
            if count > FLOOD:
                reason = f"More than {FLOOD} messages a second".encode()
                await sender.close(code=WSCloseCode.POLICY_VIOLATION, message=reason)
            elif self._is_held(now, besides=sender):
                await _report(sender, "Another sender moves the robot.")
            elif message.type in (WSMsgType.TEXT, WSMsgType.BINARY):
                try:
                    frame = PoseFrame.parse(message.data)
                except DeviceError as error:
                    self.refused = str(error)
                    await _report(sender, self.refused)
                    continue
                if sender in self._heard:  # it was not told to leave
                    self._holder, self._heard[sender] = sender, now
                    self._keep(frame)

    def _is_held(self, now: float, *, besides: web.WebSocketResponse) -> bool:
        """Return whether another sender moves the robot."""
        if self._holder is None or self._holder is besides:
            return False
        return now - self._heard[self._holder] < HOLD

    def _keep(self, frame: PoseFrame) -> None:
        with self._lock:
            self._newest = frame
            if len(self._pressed) < MAX_BUTTONS:
                self._pressed.update(frame.buttons)


async def _report(sender: web.WebSocketResponse, text: str) -> None:
    with contextlib.suppress(ConnectionError):
        await sender.send_str(json.dumps({"error": text}))


async def _give_way(sender: web.WebSocketResponse) -> None:
    with contextlib.suppress(ConnectionError):
        reason = b"Silent, while others wait"
        await sender.close(code=WSCloseCode.TRY_AGAIN_LATER, message=reason)
