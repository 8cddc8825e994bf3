"""A viser server behind its gate: what every page of ours is served by."""

import contextlib
import io
import socket
from typing import TYPE_CHECKING

from wbc_suite.devices.admission import is_loopback, new_secret
from wbc_suite.errors import DeviceError
from wbc_suite.viewers.access import MARK, AccessGate

if TYPE_CHECKING:
    import viser
    from viser.infra import WebsockClientConnection

__all__ = ["Site"]

PORTS = range(8080, 8100)  # tried in turn when none is asked for


class Site:
    """A page's server and the address that people open.

    Args:
        host: Address to listen on. Other than this machine's own, it makes a token.
        port: Port to listen on; 0 takes any free one, None the first free of a few.

    Raises:
        DeviceError: If the port cannot be had.
    """

    def __init__(self, host: str = "127.0.0.1", port: int | None = None) -> None:
        self.host = host
        self.token = None if is_loopback(host) else new_secret()
        mark = new_secret()
        self.server = _viser(mark)
        try:
            self._gate = self._open_gate(PORTS if port is None else [port], mark)
        except DeviceError:
            self.server.stop()
            raise
        self.port = self._gate.port

    @property
    def url(self) -> str:
        """The address that opens the page, with its token if it has one."""
        name = _reachable(self.host)
        shown = f"[{name}]" if ":" in name else name
        query = "" if self.token is None else f"?token={self.token}"
        return f"http://{shown}:{self.port}/{query}"

    def stop(self) -> None:
        """Close gate and server."""
        self._gate.stop()
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()

    def _open_gate(self, ports: "range | list[int]", mark: str) -> AccessGate:
        for port in ports:
            try:
                return AccessGate(
                    host=self.host,
                    port=port,
                    upstream=self.server.get_port(),
                    mark=mark,
                    token=self.token,
                )
            except DeviceError:
                if port == ports[-1]:
                    raise
        raise AssertionError("there is always a port to try")


def _viser(mark: str) -> "viser.ViserServer":
    """Start viser on 127.0.0.1, silent, for marked connections only.

    Its messages that open a tunnel through somebody else's computers are taken out.
    """
    import viser
    from viser import _messages

    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    inner = server._websock_server
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        inner.unregister_handler(message)

    @inner.on_client_connect
    async def _(client: "WebsockClientConnection") -> None:
        connection = inner._live_connections[client.client_id]
        request = connection.request
        if request is None or request.headers.get(MARK) != mark:
            await connection.close(1008, "Come in by the gate.")

    return server


def _reachable(host: str) -> str:
    """Return a name for `host` that works from where people are."""
    if host not in ("0.0.0.0", "::"):
        return host
    probe = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with probe, contextlib.suppress(OSError):
        probe.connect(("192.0.2.1", 9))  # sends nothing; picks the way out
        return probe.getsockname()[0]
    return socket.gethostname()
