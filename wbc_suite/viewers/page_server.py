"""The server of every browser page: viser, behind a reverse proxy that checks access.

viser has neither tokens nor checks of origins, so it listens on a Unix socket of this
user only, see `PrivateViser`. The proxy listens where clients connect, admits them by
`AccessRules`, fetches pages and relays WebSocket messages. A client that sends an
invalid one is disconnected. The proxy adds style and scripts of `pages/` to the page.
"""

import asyncio
import html
import threading
import time
from collections.abc import Callable, Sequence
from http import HTTPStatus
from pathlib import Path
from typing import TypeAlias
from urllib.parse import quote

import aiohttp
from aiohttp import WSMsgType, hdrs, web

from wbc_suite import logs
from wbc_suite.errors import DeviceError
from wbc_suite.viewers import page_messages
from wbc_suite.viewers.held_keys import SOCKET, HeldKeys
from wbc_suite.web.server import WebServer, file_routes, page_url, token_for

log = logs.logger(__name__)

UPDATE_RATE = 25.0  # Hz
PORTS = range(8080, 8100)  # tried in turn if no port is given
MESSAGE_LIMIT = 50 * 1024 * 1024  # bytes from viser, its own limit
HEARTBEAT = 30.0  # s between pings that find clients that are gone

FILES = ("held_keys.js", "page.js", "page.css")
HEAD = (
    b'<head><script src="/held_keys.js"></script><script src="/page.js"></script>'
    b'<link rel="stylesheet" href="/page.css">'
)
"""Start of every page: its scripts come before viser's."""

DATA = (WSMsgType.TEXT, WSMsgType.BINARY)
WebSocket: TypeAlias = web.WebSocketResponse | aiohttp.ClientWebSocketResponse


class PageServer:
    """A viser server, the proxy in front of it, and the address that opens the page.

    Any host but a loopback address creates a token. Port 0 is any free one, None the
    first free of `PORTS`.

    Attributes:
        server: The viser server.
        token: Secret that clients need; None on a loopback address.
        keys: Keys that are held on the pages.
        title: Title of the page in its browser's tab.
        update_times: Processor time of the last updates, s.

    Raises:
        DeviceError: If the port is not available.
    """

    def __init__(self, host: str = "127.0.0.1", port: int | None = None) -> None:
        from wbc_suite.viewers.private_viser import PrivateViser  # viser is heavy

        self.host, self.token = host, token_for(host)
        self.server, self.keys = PrivateViser(), HeldKeys()
        self.title = "wbc_suite"
        try:
            self._proxy = self._start_proxy(PORTS if port is None else [port])
        except DeviceError:
            self.server.stop()
            raise
        self.port = self._proxy.port
        self.update_times: list[float] = []
        self._stopping = threading.Event()
        self._updates: threading.Thread | None = None

    @property
    def url(self) -> str:
        """The address that opens the page, with the token if there is one."""
        return page_url(self.host, self.port, self.token)

    def start_updates(self, update: Callable[[int], None]) -> None:
        """Call a function with a count at `UPDATE_RATE`, in a thread, until `stop`."""
        self._updates = threading.Thread(
            target=self._run_updates, args=(update,), name="updates", daemon=True
        )
        self._updates.start()

    def stop(self) -> None:
        """Stop the updates, and close the proxy and the viser server."""
        self._stopping.set()
        if self._updates is not None:
            self._updates.join()
        self._proxy.stop()
        self.server.stop()

    def _run_updates(self, update: Callable[[int], None]) -> None:
        count = 0
        while not self._stopping.wait(1.0 / UPDATE_RATE):
            began = time.thread_time()
            try:
                update(count)
            except RuntimeError:
                # A client connected or left while viser iterated over them. What was
                # not sent still differs from what is displayed: it is sent next time.
                log.debug("The page missed an update", exc_info=True)
            except Exception:  # one client must not stop the others
                log.exception("The page missed an update")
            self.update_times = [*self.update_times[-999:], time.thread_time() - began]
            count += 1

    def _rewrite(self, page: bytes) -> bytes:
        title = f"<title>{html.escape(self.title)}</title>"
        page = page.replace(b"<title>Viser</title>", title.encode(), 1)
        return page.replace(b"<head>", HEAD, 1)

    def _start_proxy(self, ports: Sequence[int]) -> WebServer:
        routes = [
            web.get(SOCKET, self.keys.serve),
            *file_routes("viewers/pages", FILES),
            *proxy(self.server.path, self._rewrite, admits=page_messages.is_valid),
        ]
        for port in ports:
            try:
                return WebServer(self.host, port, routes, token=self.token)
            except DeviceError:
                if port == ports[-1]:
                    raise
        raise AssertionError("there is at least one port")


def proxy(
    path: Path,
    rewrite: Callable[[bytes], bytes] = bytes,
    *,
    admits: Callable[[str | bytes], bool],
) -> list[web.AbstractRouteDef]:
    """Return routes that pass every GET request on to a Unix socket.

    Args:
        path: The socket.
        rewrite: Changes the page at `/`.
        admits: Whether a client may send a message; others end its connection.
    """

    async def handle(request: web.Request) -> web.StreamResponse:
        target = f"http://localhost{quote(request.path)}"
        upstream = aiohttp.ClientSession(
            connector=aiohttp.UnixConnector(str(path), force_close=True),
            auto_decompress=False,
        )
        try:
            async with upstream:
                if request.headers.get(hdrs.UPGRADE, "").lower() == "websocket":
                    return await _relay(request, upstream, target, admits)
                return await _fetch(request, upstream, target, rewrite)
        except (aiohttp.ClientError, TimeoutError):
            return web.Response(status=HTTPStatus.BAD_GATEWAY)

    return [web.get("/{path:.*}", handle, allow_head=False)]


async def _fetch(
    request: web.Request,
    upstream: aiohttp.ClientSession,
    target: str,
    rewrite: Callable[[bytes], bytes],
) -> web.Response:
    """Fetch a file in its encoding; the page is changed and compressed."""
    is_page = request.path == "/"
    given = "identity" if is_page else request.headers.get(hdrs.ACCEPT_ENCODING)
    accepted = {hdrs.ACCEPT_ENCODING: given or "identity"}
    async with upstream.get(target, headers=accepted, allow_redirects=False) as answer:
        kept = (hdrs.CONTENT_TYPE, hdrs.CONTENT_ENCODING)
        headers = {k: answer.headers[k] for k in kept if k in answer.headers}
        body = await answer.read()
        body = rewrite(body) if is_page else body
        found = web.Response(status=answer.status, body=body, headers=headers)
        if is_page:
            found.enable_compression()
        return found


async def _relay(
    request: web.Request,
    upstream: aiohttp.ClientSession,
    target: str,
    admits: Callable[[str | bytes], bool],
) -> web.WebSocketResponse:
    """Relay the messages of a WebSocket both ways until one side closes it."""
    offered = request.headers.get(hdrs.SEC_WEBSOCKET_PROTOCOL, "").split(",")
    async with upstream.ws_connect(
        target,
        protocols=[name.strip() for name in offered if name.strip()],
        max_msg_size=MESSAGE_LIMIT,
    ) as server:
        client = web.WebSocketResponse(
            protocols=[server.protocol] if server.protocol else (),
            max_msg_size=page_messages.MAX_BYTES,
            heartbeat=HEARTBEAT,
            compress=False,
        )
        await client.prepare(request)
        await asyncio.gather(
            _copy(client, server, admits),
            _copy(server, client, lambda _: True),
            return_exceptions=True,
        )
        return client


async def _copy(
    source: WebSocket, sink: WebSocket, admits: Callable[[str | bytes], bool]
) -> None:
    """Copy messages until the source closes; close the sink with the same reason."""
    while (message := await source.receive()).type in DATA:
        if not admits(message.data):
            log.warning("A viewer sent an invalid message and was disconnected.")
            await source.close(code=aiohttp.WSCloseCode.POLICY_VIOLATION)
            break
        if message.type is WSMsgType.TEXT:
            await sink.send_str(message.data)
        else:
            await sink.send_bytes(message.data)
    if message.type is WSMsgType.CLOSE:
        code, reason = message.data or aiohttp.WSCloseCode.OK, message.extra or ""
        await sink.close(code=code, message=reason.encode())
    else:
        await sink.close()
