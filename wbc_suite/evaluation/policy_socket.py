"""Policies in another process or on another machine, over a TCP socket.

Each message is one line of JSON, and each request has one answer:

    {"reset": {"seed": 7, "benchmark": "Lift", "robots": ["Panda"], ...}}  ->  {}
    {"observation": {"cube_pos": ARRAY, ...}}             ->  {"action": ARRAY}

or `{"error": "..."}`. An ARRAY is `{"dtype": "<f8", "shape": [3], "data": "..."}` with
the bytes in base64, so that every bit arrives. A connection serves one episode after
another.
"""

import base64
import json
import socket
import socketserver
from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeAlias

import numpy as np

from wbc_suite.errors import ConfigError, DeviceError, WbcError
from wbc_suite.typing import Vector

SCHEME = "socket://"
MAX_BYTES = 64 << 20  # of a message
TIMEOUT = 300.0  # s, for an answer; a server may have to compile first
KINDS = "biuf"  # NumPy's kinds of arrays that are sent

Message: TypeAlias = dict[str, Any]
Act: TypeAlias = Callable[[Mapping[str, Any]], Any]
Begin: TypeAlias = Callable[[Mapping[str, Any]], Act]
"""From the `reset` of an episode to its policy."""


class _Reader(Protocol):
    def readline(self, size: int, /) -> bytes: ...


class _Writer(Protocol):
    def write(self, data: bytes, /) -> int: ...

    def flush(self) -> None: ...


class SocketPolicy:
    """The policy of one episode, which a server runs.

    Args:
        address: `socket://HOST:PORT`.
        reset: What the server is told of the episode, plain JSON data.

    Raises:
        ConfigError: If the address is wrong.
        DeviceError: If the server cannot be reached, fails, or answers with nonsense.
    """

    def __init__(self, address: str, reset: Mapping[str, Any]) -> None:
        host, _, port = address.removeprefix(SCHEME).rpartition(":")
        if not host or not port.isdigit():
            raise ConfigError(f"The policy '{address}' is not {SCHEME}HOST:PORT.")
        self._place = address
        try:
            self._socket = socket.create_connection((host, int(port)), TIMEOUT)
        except OSError as error:
            raise DeviceError(f"No policy answers at {address}: {error}.") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._file = self._socket.makefile("rwb")
        try:
            self._ask({"reset": dict(reset)})
        except WbcError:
            self.close()
            raise

    def __call__(self, observation: Mapping[str, Any]) -> Vector:
        """Return the server's action."""
        sent = {key: encode(value) for key, value in observation.items()}
        answer = self._ask({"observation": sent})
        try:
            return np.asarray(decode(answer["action"]), dtype=np.float64)
        except (KeyError, ValueError) as error:
            text = f"The policy at {self._place} sent no action: {error}."
            raise DeviceError(text) from error

    def close(self) -> None:
        """End the connection."""
        self._file.close()
        self._socket.close()

    def _ask(self, message: Message) -> Message:
        try:
            _send(self._file, message)
            answer = _receive(self._file)
        except (OSError, ValueError) as error:
            text = f"Lost the policy at {self._place}: {error}."
            raise DeviceError(text) from error
        if answer is None:
            raise DeviceError(f"The policy at {self._place} closed the connection.")
        if "error" in answer:
            text = f"The policy at {self._place} failed: {answer['error']}"
            raise DeviceError(text)
        return answer


class PolicyServer(socketserver.ThreadingTCPServer):
    """Serves policies; `serve_forever` and `shutdown` are those of `socketserver`.

    It has no password: anyone who reaches the port can use the policy.

    Args:
        begin: Makes the policy of an episode from what a client says of it. Called in a
            thread of each connection.
        host: Address to listen on.
        port: Port to listen on; 0 for any free one.
    """

    allow_reuse_address = True
    daemon_threads = True

    def __init__(self, begin: Begin, *, host: str = "127.0.0.1", port: int = 0) -> None:
        self.begin = begin
        try:
            super().__init__((host, port), _Connection)
        except OSError as error:
            raise DeviceError(f"Cannot listen on {host}:{port}: {error}.") from error

    @property
    def address(self) -> str:
        """What a client gives as its policy."""
        host, port = self.server_address[:2]
        return f"{SCHEME}{host}:{port}"


class _Connection(socketserver.StreamRequestHandler):
    disable_nagle_algorithm = True
    act: Act | None = None

    def handle(self) -> None:
        """Answer requests until the client leaves, or talks nonsense."""
        try:
            while (message := _receive(self.rfile)) is not None:
                _send(self.wfile, self._answer(message))
        except (OSError, ValueError):
            return

    def _answer(self, message: Message) -> Message:
        reset, seen = message.get("reset"), message.get("observation")
        assert isinstance(self.server, PolicyServer), "it makes the connections"
        try:
            if isinstance(reset, dict):
                self.act = self.server.begin(reset)
                return {}
            if isinstance(seen, dict) and self.act is not None:
                action = self.act({key: decode(value) for key, value in seen.items()})
                return {"action": encode(np.asarray(action))}
        except Exception as error:  # noqa: BLE001 - the client is told
            return {"error": f"{type(error).__name__}: {error}"}
        return {"error": "Send a reset first, then observations."}


def encode(value: Any) -> Message:
    """Return a number or an array as JSON data."""
    array = np.asarray(value)
    little = array.astype(array.dtype.newbyteorder("<"), order="C", copy=False)
    data = base64.b64encode(little.tobytes()).decode("ascii")
    return {"dtype": little.dtype.str, "shape": list(array.shape), "data": data}


def decode(value: Any) -> np.ndarray:
    """Return the array; ValueError if the data is none."""
    try:
        dtype = np.dtype(str(value["dtype"]))
        if dtype.kind not in KINDS:
            raise ValueError(f"{dtype} is not a numeric type")
        flat = np.frombuffer(base64.b64decode(value["data"], validate=True), dtype)
        return flat.reshape([int(n) for n in value["shape"]]).copy()
    except (TypeError, KeyError) as error:
        raise ValueError(f"not an array: {str(value)[:60]}") from error


def _send(file: _Writer, message: Message) -> None:
    file.write(json.dumps(message).encode() + b"\n")
    file.flush()


def _receive(file: _Reader) -> Message | None:
    """Return the next message; None at the end, ValueError if it is none."""
    line = file.readline(MAX_BYTES)
    if not line:
        return None
    message = json.loads(line)
    if not isinstance(message, dict):
        raise ValueError("a message is a JSON object")
    return message
