"""The stream: pose frames over WebSocket, and the pages that send them."""

import asyncio
import contextlib
import json
import logging
import socket
import ssl
import threading
import time
from dataclasses import replace
from http import HTTPStatus
from importlib import resources
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from wbc_suite.devices.admission import Admission, Refusal, is_loopback, new_secret
from wbc_suite.devices.frame import MAX_BUTTONS, MAX_BYTES, PoseFrame
from wbc_suite.devices.listening import listen
from wbc_suite.devices.state import DeviceState
from wbc_suite.devices.tls import server_context
from wbc_suite.errors import DeviceError

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

__all__ = ["Stream"]

SOCKET = "/frames"
PAGES = {"/": "controls.html", "/xr": "xr.html"}
CONNECTIONS = 8  # at a time; only one of them moves the robot
FLOOD = 2000  # messages in a second that end a connection; a headset sends 90
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "connect-src 'self'"
)


class Stream:
    """A device that listens: whoever connects first and sends frames moves the robot.

    It listens on this machine only, unless told otherwise; then it asks for a token.

    Args:
        host: Address to listen on.
        port: Port; 0 takes a free one.
        tls: Whether to encrypt, with a key made on this machine; headsets ask for it.
    """

    def __init__(
        self, host: str = "127.0.0.1", port: int = 8090, *, tls: bool = False
    ) -> None:
        self._host, self._port, self._tls = host, port, tls
        self.token = None if is_loopback(host) else new_secret()
        self._lock = threading.Lock()
        self._newest: PoseFrame | None = None
        self._pressed: set[str] = set()
        self._state = DeviceState(time=0.0)
        self._holder: ServerConnection | None = None
        self._open = 0
        self._thread: threading.Thread | None = None
        self.refused = ""

    @property
    def url(self) -> str:
        """The address of the pages; frames go to `/frames` there."""
        name = socket.gethostname() if self._host in ("0.0.0.0", "::") else self._host
        name = f"[{name}]" if ":" in name else name
        query = "" if self.token is None else f"?token={self.token}"
        return f"http{'s' if self._tls else ''}://{name}:{self._port}/{query}"

    @property
    def help(self) -> str:
        """What to tell a person."""
        return f"Stream: open {self.url} in a browser, or send pose frames.\n"

    def start(self) -> None:
        """Listen.

        Raises:
            DeviceError: If the port cannot be had, or a key cannot be made.
        """
        context = server_context() if self._tls else None
        listening = listen(self._host, self._port)
        self._port = listening.getsockname()[1]
        self._admission = Admission(self._host, self.token, f"wbc_stream_{self._port}")
        ready = threading.Event()

        def run() -> None:
            asyncio.run(self._serve(listening, context, ready))

        self._thread = threading.Thread(target=run, name="stream", daemon=True)
        self._thread.start()
        ready.wait()

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
        if self._thread is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stopping.set)
            self._thread.join()

    async def _serve(
        self,
        listening: socket.socket,
        context: ssl.SSLContext | None,
        ready: threading.Event,
    ) -> None:
        from websockets.asyncio.server import serve

        self._loop, self._stopping = asyncio.get_running_loop(), asyncio.Event()
        async with serve(
            self._receive,
            sock=listening,
            ssl=context,
            process_request=self._answer,
            max_size=MAX_BYTES,
            max_queue=4,
            compression=None,
            close_timeout=1.0,
            ping_interval=5.0,  # a sender that is gone gives its place up after 10 s
            ping_timeout=5.0,
            logger=logging.Logger("stream", logging.CRITICAL),  # strangers make noise
        ):
            ready.set()
            await self._stopping.wait()

    def _answer(self, _: "ServerConnection", request: "Request") -> "Response | None":
        """Refuse, send a page, or let a WebSocket through."""
        headers = {name.lower(): value for name, value in request.headers.raw_items()}
        refusal = self._admission.decide("GET", request.path, headers)
        if refusal is not None:
            return _response(refusal.status, refusal.text, "text/plain", refusal)
        path = urlsplit(request.path).path
        if path == SOCKET and headers.get("upgrade", "").lower() == "websocket":
            if self._open < CONNECTIONS:
                return None
            return _response(HTTPStatus.SERVICE_UNAVAILABLE, "Too many senders.")
        if path not in PAGES:
            return _response(HTTPStatus.NOT_FOUND, "There is no such page.")
        page = resources.files("wbc_suite.devices") / "pages" / PAGES[path]
        return _response(HTTPStatus.OK, page.read_text("utf-8"), "text/html")

    async def _receive(self, connection: "ServerConnection") -> None:
        """Keep the newest frame of the one sender that counts."""
        self._open += 1
        try:
            began, count = time.monotonic(), 0
            async for message in connection:
                now, count = time.monotonic(), count + 1
                if now - began > 1.0:
                    began, count = now, 0
                if count > FLOOD:
                    await connection.close(1008, f"More than {FLOOD} messages a second")
                if self._holder not in (None, connection):
                    await _send(connection, "Somebody else moves the robot.")
                    continue
                self._holder = connection
                try:
                    self._note(PoseFrame.parse(message))
                except DeviceError as error:
                    self.refused = str(error)
                    await _send(connection, self.refused)
        finally:
            self._open -= 1
            if self._holder is connection:
                self._holder = None

    def _note(self, frame: PoseFrame) -> None:
        with self._lock:
            self._newest = frame
            if len(self._pressed) < MAX_BUTTONS:
                self._pressed.update(frame.buttons)


async def _send(connection: "ServerConnection", text: str) -> None:
    from websockets.exceptions import ConnectionClosed

    with contextlib.suppress(ConnectionClosed):
        await connection.send(json.dumps({"error": text}))


def _response(
    status: HTTPStatus,
    text: str,
    kind: str = "text/plain",
    refusal: Refusal | None = None,
) -> "Response":
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    body = text.encode()
    headers = Headers(
        [
            ("Content-Type", f"{kind}; charset=utf-8"),
            ("Content-Length", str(len(body))),
            ("Content-Security-Policy", POLICY),
            ("Cache-Control", "no-store"),
            ("Connection", "close"),
            *(() if refusal is None else refusal.headers),
        ]
    )
    return Response(status.value, status.phrase, headers, body)
