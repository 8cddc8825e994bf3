"""viser on a Unix socket in a folder of this user, where only the proxy reaches it.

viser checks neither tokens nor origins, and listens on a TCP port, which every program
of this machine, and with it every page in a browser, can reach. No page can reach a
Unix socket, and no other user a folder of mode 0700.

viser has no option for that. It calls `websockets.asyncio.server.serve`, to which this
module adds the argument `sock` while a server starts. The argument is documented; that
viser makes this call is not. If a release of viser does not make it, its server is
stopped at once, and the start is an error.
"""

import contextlib
import io
import socket
import tempfile
import threading
from pathlib import Path
from typing import Any
from unittest.mock import patch

import viser
from websockets.asyncio import server as websockets_server

from wbc_suite.errors import DeviceError

_STARTING = threading.Lock()  # `serve` is replaced in the whole process


class PrivateViser(viser.ViserServer):
    """A silent viser server on a Unix socket, which clients cannot publish.

    Attributes:
        path: The socket.

    Raises:
        DeviceError: If it cannot listen there.
    """

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="wbc_suite-")  # mode 0700
        self.path = Path(self._folder.name) / "viser"
        listener, calls = _listen(self.path), list[Any]()
        serve = websockets_server.serve

        def serve_here(handler: Any, *address: Any, **options: Any) -> Any:
            calls.append(address)
            kept = {k: v for k, v in options.items() if k not in ("host", "port")}
            return serve(handler, sock=listener, **kept)

        replaced = patch.object(websockets_server, "serve", serve_here)
        with _STARTING, replaced, contextlib.redirect_stdout(io.StringIO()):
            super().__init__(host="127.0.0.1", port=0, verbose=False)
        if len(calls) != 1:
            self.stop()
            listener.close()
            raise DeviceError(
                f"viser {viser.__version__} cannot be kept from listening on a port: "
                "install a version of viser that this package was tested with."
            )

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Return None: a client could publish the page through viser's service."""
        return None

    def stop(self) -> None:
        """Stop the server, and remove the socket."""
        with contextlib.redirect_stdout(io.StringIO()):
            super().stop()
        self._folder.cleanup()


def _listen(path: Path) -> socket.socket:
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        listener.bind(str(path))
    except OSError as error:
        listener.close()
        raise DeviceError(
            f"Cannot listen on '{path}': {error}. TMPDIR names the folder of temporary "
            "files; choose one with a short path."
        ) from error
    return listener
