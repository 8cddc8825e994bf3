"""The socket that a server of ours listens on."""

import socket

from wbc_suite.errors import DeviceError

__all__ = ["listen"]


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens; port 0 takes any free one.

    Raises:
        DeviceError: If the address or the port cannot be had.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        raise DeviceError(
            f"Cannot listen on {host}, port {port}: {error.strerror}. "
            "Choose another port, or 0 for any free one."
        ) from error
