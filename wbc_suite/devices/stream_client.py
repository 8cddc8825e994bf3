"""A client of the stream, short enough to copy into any program."""

import json
from typing import Any

from wbc_suite.devices.pose_frame import PoseFrame
from wbc_suite.errors import DeviceError


class StreamClient:
    """Send pose frames to the address that a stream prints, with its token if any.

    Raises:
        DeviceError: If there is no stream at the address.
    """

    def __init__(self, url: str) -> None:
        from websockets.exceptions import InvalidHandshake
        from websockets.sync.client import connect

        address, _, query = url.partition("?")
        address = address.rstrip("/").replace("http", "ws", 1) + "/frames"
        try:
            self._socket = connect(f"{address}?{query}", compression=None)
        except (OSError, InvalidHandshake) as error:
            raise DeviceError(f"No stream answers at {address}: {error}.") from error

    def send(self, frame: PoseFrame) -> None:
        """Send one frame."""
        self._socket.send(frame.model_dump_json())

    def receive(self, timeout: float) -> dict[str, Any]:
        """Return a reply of the stream, `{"error": ...}`.

        Raises:
            TimeoutError: If none comes in time, s.
            DeviceError: If it is not JSON.
        """
        try:
            return json.loads(self._socket.recv(timeout=timeout))
        except (ValueError, RecursionError) as error:
            raise DeviceError(f"The stream's reply is not JSON: {error}.") from error

    def __enter__(self) -> "StreamClient":
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
