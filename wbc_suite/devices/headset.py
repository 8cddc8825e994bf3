"""Teleoperation with a headset: a WebXR page of our own, and what it shows."""

import asyncio
import contextlib
import io
import ssl
from html import escape
from http import HTTPStatus
from pathlib import Path
from typing import Protocol

import segno
from aiohttp import web

from wbc_suite.devices.stream import Stream
from wbc_suite.errors import ConfigError
from wbc_suite.web.certificate import (
    fingerprint,
    installation_certificate,
    server_context,
)
from wbc_suite.web.server import file_routes, is_loopback, send_file

VIEW_PERIOD = 1.0 / 60.0  # s, of the poses that are sent to a page
FOLDER = "devices/pages/headset"
FILES = (
    *("page.css", "main.js", "session.js", "hands.js", "axes.js"),
    *("scene.js", "connection.js", "three.js"),
)
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'"
)


class HeadsetView(Protocol):
    """What a headset displays; all methods are called from the server's thread."""

    @property
    def scene(self) -> bytes:
        """The meshes of all bodies, in the format of `pages/headset/scene.js`."""
        ...

    def poses(self) -> bytes:
        """Return the poses of bodies and of the hands' targets, float32, (n, 7)."""
        ...

    def status(self) -> str:
        """Return what is displayed in words and colours, as JSON."""
        ...


class Headset(Stream):
    """Serve a WebXR page, whose head, hands and sticks are those of a `DeviceState`.

    Browsers allow WebXR only on secure pages: on `localhost`, which `adb
    reverse` forwards to this machine, or with TLS. On an address other than a loopback
    one it uses TLS, and clients need a token.

    Args:
        host: Address to listen on; `0.0.0.0` for headsets in the same network.
        port: Port to listen on, 0 for any free one.
        tls_cert: PEM file of the user's own certificate; by default one is made.
        tls_key: PEM file of its key.

    Raises:
        ConfigError: If only one of certificate and key is given.
    """

    def __init__(
        self,
        host: str = "127.0.0.1",
        port: int = 8090,
        *,
        tls_cert: str = "",
        tls_key: str = "",
    ) -> None:
        if bool(tls_cert) != bool(tls_key):
            raise ConfigError("tls_cert and tls_key are given together, or neither.")
        own = bool(tls_cert)
        super().__init__(host, port, tls=own or not is_loopback(host))
        self._certificate = (Path(tls_cert), Path(tls_key)) if own else None
        self._view: HeadsetView | None = None

    @property
    def help(self) -> str:
        """The address, its QR code where others reach it, and the ways to connect."""
        lines = [f"Headset: open {self.url} in its browser.", ""]
        if not is_loopback(self._host):
            code = io.StringIO()
            segno.make_qr(self.url).terminal(code, compact=True)
            lines.append(code.getvalue())
        lines += [
            f"  {k}. {title} {text}" for k, (title, text) in enumerate(self.ways, 1)
        ]
        return "\n".join(lines).replace("`", "") + "\n"

    @property
    def ways(self) -> tuple[tuple[str, str], ...]:
        """How a headset gets a secure page: title and steps; commands in backticks."""
        scheme = "https" if self._tls else "http"
        query = "" if self.token is None else f"?token={self.token}"
        local = f"{scheme}://localhost:{self._port}/{query}"
        return (
            (
                "By cable.",
                "Enable developer mode on the headset and connect it by USB. "
                f"Run `adb reverse tcp:{self._port} tcp:{self._port}`, then open "
                f"`{local}` in the headset.",
            ),
            ("By network.", self._network_steps()),
            (
                "With your own certificate.",
                "Start with `--device-option host=0.0.0.0 --tls-cert FILE.pem "
                "--tls-key FILE.pem`, and open the printed address with the name in "
                "the certificate in place of the host.",
            ),
        )

    def show(self, view: HeadsetView) -> None:
        """Display a view to everybody who opens the page."""
        self._view = view

    def _network_steps(self) -> str:
        if is_loopback(self._host):
            return (
                "Start with `--device-option host=0.0.0.0`. A certificate is made for "
                "this installation, and the address is printed with its QR code."
            )
        steps = f"Scan the QR code, or open `{self.url}` in the headset."
        if self._certificate is not None:
            return steps
        mark = fingerprint(installation_certificate()[0])
        return (
            f"{steps} The browser warns once about the certificate of this "
            "installation: choose Advanced, then Proceed. Its SHA-256 fingerprint is "
            f"{mark}."
        )

    def _routes(self) -> list[web.RouteDef]:
        return [
            web.get("/", self._send_index),
            *file_routes(FOLDER, FILES, policy=POLICY),
            web.get("/scene", self._send_scene),
            web.get("/qr.svg", self._send_qr),
            web.get("/frames", self._receive),
        ]

    def _tls_context(self) -> ssl.SSLContext | None:
        if self._certificate is not None:
            return server_context(*self._certificate)
        return super()._tls_context()

    async def _send_index(self, _: web.Request) -> web.Response:
        ways = "".join(
            f"<li><b>{title}</b> {_with_code(text)}</li>" for title, text in self.ways
        )
        values = {"ADDRESS": escape(self.url), "WAYS": ways}
        return send_file(FOLDER, "index.html", policy=POLICY, **values)

    async def _send_scene(self, _: web.Request) -> web.Response:
        if self._view is None:  # the robot is still being prepared
            return web.Response(status=HTTPStatus.NO_CONTENT)
        return web.Response(
            body=self._view.scene, content_type="application/octet-stream"
        )

    async def _send_qr(self, _: web.Request) -> web.Response:
        code = io.BytesIO()
        picture = {"light": "#fff", "omitsize": True}
        segno.make_qr(self.url).save(code, kind="svg", **picture)
        return web.Response(body=code.getvalue(), content_type="image/svg+xml")

    async def _receive_frames(self, sender: web.WebSocketResponse) -> None:
        """Display the view to a sender while its frames are received."""
        display = asyncio.create_task(self._display(sender))
        try:
            await super()._receive_frames(sender)
        finally:
            display.cancel()

    async def _display(self, viewer: web.WebSocketResponse) -> None:
        """Send poses to a viewer as fast as it takes them, and texts that changed."""
        shown = ""
        with contextlib.suppress(ConnectionError):
            while not viewer.closed:
                if self._view is None:
                    await viewer.send_str("{}")  # it tells a server that is gone
                    await asyncio.sleep(0.1)
                    continue
                await viewer.send_bytes(self._view.poses())
                status = self._view.status()
                if status != shown:
                    await viewer.send_str(status)
                    shown = status
                await asyncio.sleep(VIEW_PERIOD)


def _with_code(text: str) -> str:
    """Return text as HTML; what is between backticks is code."""
    parts = [escape(part) for part in text.split("`")]
    return "".join(f"<code>{p}</code>" if k % 2 else p for k, p in enumerate(parts))
