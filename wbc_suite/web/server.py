"""The HTTP server of pages and streams: aiohttp in a thread, behind `AccessRules`.

- A page of another site in the user's browser must not reach the server: the `Origin`
  of a request must be the host that it asks for. Without a token that host must be a
  loopback address, which stops DNS names that point at 127.0.0.1.
- Such a page must not get files or show pages of the server as its own either: its
  requests other than links are refused, and `HEADERS` keep pages out of frames.
- Clients on other machines need the token. The address that opens the page carries it
  once; the answer replaces it by a cookie that scripts cannot read.
"""

import asyncio
import contextlib
import hmac
import ipaddress
import logging
import secrets
import socket
import ssl
import threading
from collections.abc import Iterable
from http import HTTPStatus
from http.cookies import CookieError
from importlib import resources
from pathlib import Path
from string import Template
from urllib.parse import urlsplit

from aiohttp import hdrs, web
from aiohttp.typedefs import Handler

from wbc_suite import logs
from wbc_suite.errors import DeviceError

logger = logs.logger(__name__)

CONNECTIONS = 256  # at a time; a browser opens one, and a few more while it loads
HEAD_TIMEOUT = 10.0  # s, to the first and between two complete requests
SHUTDOWN_TIMEOUT = 0.2  # s; handlers of open WebSockets are cancelled after it
TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}

HEADERS = {
    hdrs.CONTENT_SECURITY_POLICY: "frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'none'; object-src 'none'",
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",  # the address may hold the token
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
"""Headers of every answer. A page may add a stricter policy: browsers keep both.

Source: OWASP, HTTP Security Response Headers Cheat Sheet
"""


NO_STORE = {hdrs.CACHE_CONTROL: "no-store"}


def is_loopback(host: str) -> bool:
    """Return whether a host name or an address is this machine's loopback."""
    if host == "localhost":
        return True
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    return False


def token_for(host: str) -> str | None:
    """Return a new secret of 128 bits, valid in a URL; None for a loopback address."""
    return None if is_loopback(host) else secrets.token_urlsafe(16)


def page_url(host: str, port: int, token: str | None, *, scheme: str = "http") -> str:
    """Return the address that opens the pages of a server, with its token if any."""
    name = reachable_name(host)
    name = f"[{name}]" if ":" in name else name
    query = "" if token is None else f"?token={token}"
    return f"{scheme}://{name}:{port}/{query}"


def send_file(
    folder: str, name: str, *, policy: str = "", **values: str
) -> web.Response:
    """Return the answer that sends a text file of this package; nobody caches it.

    Args:
        folder: Its folder in the package, such as `viewers/pages`.
        name: Its name.
        policy: Content-Security-Policy of a page.
        values: Take the place of `$NAME` in the text, as HTML.
    """
    text = (resources.files("wbc_suite") / folder / name).read_text("utf-8")
    return web.Response(
        text=Template(text).substitute(values) if values else text,
        content_type=TYPES[Path(name).suffix],
        headers=NO_STORE | ({hdrs.CONTENT_SECURITY_POLICY: policy} if policy else {}),
    )


def file_routes(
    folder: str, names: Iterable[str], *, policy: str = ""
) -> list[web.RouteDef]:
    """Return routes `/NAME` of files; see `send_file`."""

    async def send(request: web.Request) -> web.Response:
        return send_file(folder, request.path[1:], policy=policy)

    return [web.get(f"/{name}", send) for name in names]


class WebServer:
    """Serve routes to the clients that the access rules admit.

    aiohttp limits the size of request lines and header fields (8 kB each). Connections
    without a request for `HEAD_TIMEOUT` are closed; where there are `CONNECTIONS`, the
    one that has waited longest for its first request makes room for the next.

    Port 0 is any free one. `token` is the secret that clients need; None if `host` is a
    loopback address. Without `tls` it is plain HTTP.

    Raises:
        DeviceError: If the port is not available, or a token is missing.
    """

    def __init__(
        self,
        host: str,
        port: int,
        routes: Iterable[web.AbstractRouteDef],
        *,
        token: str | None,
        tls: ssl.SSLContext | None = None,
    ) -> None:
        if token is None and not is_loopback(host):
            raise DeviceError(
                f"A server on '{host}' can be reached by others and needs a token."
            )
        self._socket = _listen(host, port)
        self.port: int = self._socket.getsockname()[1]
        self._rules = AccessRules(token, cookie=f"wbc_token_{self.port}")
        self._routes, self._tls = tuple(routes), tls
        self._no_request_yet: set[web.RequestHandler] = set()
        started = threading.Event()
        self._thread = threading.Thread(
            target=lambda: asyncio.run(self._serve(started)), name="web", daemon=True
        )
        self._thread.start()
        started.wait()

    def stop(self) -> None:
        """Close the port and every connection."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stopping.set)
            self._thread.join()

    async def _serve(self, started: threading.Event) -> None:
        self._loop, self._stopping = asyncio.get_running_loop(), asyncio.Event()
        app = web.Application(middlewares=[self._admit])
        app.add_routes(self._routes)
        app.on_response_prepare.append(_add_headers)
        runner = web.AppRunner(
            app,
            access_log=None,
            keepalive_timeout=HEAD_TIMEOUT,
            shutdown_timeout=SHUTDOWN_TIMEOUT,
            logger=logging.Logger("web", logging.CRITICAL),  # malformed requests
        )
        await runner.setup()
        listener = await self._loop.create_server(
            lambda: self._accept(runner.server),
            sock=self._socket,
            ssl=self._tls,
            ssl_handshake_timeout=HEAD_TIMEOUT if self._tls else None,
        )
        started.set()
        try:
            await self._stopping.wait()
        finally:
            listener.close()
            await runner.cleanup()

    def _accept(self, server: web.Server | None) -> asyncio.Protocol:
        """Return the protocol of a new connection."""
        if server is None:
            return _Refused()
        if len(server.connections) >= CONNECTIONS:
            silent = (c for c in server.connections if c in self._no_request_yet)
            longest = next(silent, None)  # connections are in order
            if longest is None:
                return _Refused()
            self._close_without_request(longest)
        connection = server()
        self._no_request_yet.add(connection)
        self._loop.call_later(HEAD_TIMEOUT, self._close_without_request, connection)
        return connection

    def _close_without_request(self, connection: web.RequestHandler) -> None:
        if connection in self._no_request_yet:
            self._no_request_yet.discard(connection)
            connection.force_close()

    @web.middleware
    async def _admit(
        self, request: web.Request, handler: Handler
    ) -> web.StreamResponse:
        """Refuse a request that the rules keep out; handle any other."""
        self._no_request_yet.discard(request.protocol)
        refusal = self._rules.refusal(request)
        return await handler(request) if refusal is None else refusal


async def _add_headers(_: web.Request, response: web.StreamResponse) -> None:
    for name, value in HEADERS.items():
        response.headers.add(name, value)


class _Refused(asyncio.Protocol):
    """A connection beyond the limit: closed at once."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        transport.close()


def _listen(host: str, port: int) -> socket.socket:
    """Return a listening socket; port 0 takes any free port."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        raise DeviceError(
            f"Cannot listen on {host}, port {port}: {error.strerror}. "
            "Choose another port, or 0 for any free one."
        ) from error


def reachable_name(host: str) -> str:
    """Return a name for `host` under which other machines reach it."""
    if host not in ("0.0.0.0", "::"):
        return host
    probe = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with probe, contextlib.suppress(OSError):
        probe.connect(("192.0.2.1", 9))  # sends nothing; selects the outgoing address
        return probe.getsockname()[0]
    return socket.gethostname()


class AccessRules:
    """Decide which requests are admitted.

    Clients need the token; without one those of this machine are admitted. `cookie` is
    the name of the cookie that stands for it.
    """

    def __init__(self, token: str | None, cookie: str) -> None:
        self._token, self._cookie = token, cookie

    def refusal(self, request: web.Request) -> web.Response | None:
        """Return the refusal of a request, or None to admit it."""
        if request.method != hdrs.METH_GET:
            return _response(HTTPStatus.METHOD_NOT_ALLOWED, "Only GET is supported.")
        host = request.headers.get(hdrs.HOST, "")
        if self._token is None and not is_loopback(_host_name(host)):
            return _response(
                HTTPStatus.FORBIDDEN,
                "This page is served to this machine only: open it as 127.0.0.1.",
            )
        if _is_foreign(request, host):
            return _response(HTTPStatus.FORBIDDEN, "Cross-site requests are refused.")
        return None if self._token is None else self._check_token(self._token, request)

    def _check_token(self, token: str, request: web.Request) -> web.Response | None:
        with contextlib.suppress(CookieError):
            if _same(token, request.cookies.get(self._cookie, "")):
                return None
        if not _same(token, request.query.get("token", "")):
            return _response(
                HTTPStatus.UNAUTHORIZED,
                "This page needs its token: open the whole address that the terminal "
                "shows, with '?token=' and what follows.",
            )
        if request.headers.get(hdrs.UPGRADE, "").lower() == "websocket":
            return None
        response = _response(HTTPStatus.SEE_OTHER)
        path = request.rel_url.raw_path.lstrip("/\\")  # a redirect to this host only
        response.headers[hdrs.LOCATION] = f"/{path}"
        response.set_cookie(
            self._cookie, token, httponly=True, samesite="Lax", secure=request.secure
        )
        return response


def _is_foreign(request: web.Request, host: str) -> bool:
    """Return whether a page of another site sent a request, but for a followed link.

    Browsers send the origin with WebSockets, and `Sec-Fetch-*` with what a page loads.
    """
    origin = request.headers.get(hdrs.ORIGIN)
    if origin is not None and origin.partition("://")[2] != host:
        logger.warning("Refused a request from a page of %.200r.", origin)
        return True
    site = request.headers.get("Sec-Fetch-Site", "none")
    return (
        site not in ("same-origin", "none")
        and request.headers.get("Sec-Fetch-Dest") != "document"
    )


def _response(status: HTTPStatus, text: str = "") -> web.Response:
    return web.Response(status=status, text=text, headers=NO_STORE)


def _same(token: str, candidate: str) -> bool:
    return hmac.compare_digest(candidate.encode(), token.encode())


def _host_name(host: str) -> str:
    """Return the name in a Host header, without its port."""
    with contextlib.suppress(ValueError):
        return urlsplit(f"//{host}").hostname or ""
    return ""
