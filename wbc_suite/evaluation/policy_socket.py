"""Policies in another process or on another machine, over a TCP socket.

Each message is one line of JSON, and each request has one answer:

    {"reset": {"seed": 7, "benchmark": "Lift", "robots": ["Panda"], ...}}  ->  {}
    {"observation": {"cube_pos": ARRAY, ...}}             ->  {"action": ARRAY}

or `{"error": "..."}`. An ARRAY is `{"dtype": "<f8", "shape": [3], "data": "..."}` with
the bytes in base64, so that every bit arrives. A connection serves one episode after
another. Its first message has the `token` beside `reset`, if the server has one.
"""

import base64
import contextlib
import hmac
import json
import re
import socket
import socketserver
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import Any, TypeAlias

import numpy as np

from wbc_suite.errors import ConfigError, DeviceError, WbcError, shortened
from wbc_suite.typing import Vector

SCHEME = "socket://"
MAX_BYTES = 64 << 20  # of a message: three pictures of 2048 x 2048 pixels
MAX_ANSWER = 1 << 20  # bytes; an action takes a few thousand
MAX_VALUES = 20_000  # of JSON in a message; an array counts as ten
LARGE = 1 << 20  # bytes; messages above it are received a few at a time
LARGE_AT_ONCE = 4  # messages
FIRST = 10.0  # s, for the first message of a connection
IDLE = 300.0  # s, for the others, and for an answer; both sides may have to compile
TRANSFER = 60.0  # s, from the first byte of a message to the last
CONNECTIONS = 64  # at a time, unless told otherwise
MAX_ERROR = 2_000  # characters
FULL = b'{"error": "All connections of this server are taken."}\n'
DTYPE = re.compile(r"[<>|]?[biuf]\d{1,2}")
"""NumPy's types of arrays that are sent."""

Message: TypeAlias = dict[str, Any]
Act: TypeAlias = Callable[[Mapping[str, Any]], Any]
Begin: TypeAlias = Callable[[Mapping[str, Any]], Act]
"""From the `reset` of an episode to its policy."""


class SocketPolicy:
    """The policy of one episode, which a server runs.

    Args:
        address: `socket://HOST:PORT`, or `socket://TOKEN@HOST:PORT`.
        reset: What the server is told of the episode, plain JSON data.

    Raises:
        ConfigError: If the address is wrong.
        DeviceError: If the server cannot be reached, fails, or answers with nonsense.
    """

    def __init__(self, address: str, reset: Mapping[str, Any]) -> None:
        token, _, place = address.removeprefix(SCHEME).rpartition("@")
        host, _, port = place.rpartition(":")
        if not host or not port.isdecimal() or int(port) > 65_535:
            raise ConfigError(f"The policy '{address}' is not {SCHEME}HOST:PORT.")
        self._place = f"{SCHEME}{place}"
        try:
            self._socket = socket.create_connection((host, int(port)), TRANSFER)
        except (OSError, UnicodeError) as error:
            text = f"No policy answers at {self._place}: {error}."
            raise DeviceError(text) from error
        self._lines = _Lines(self._socket)
        try:
            first = {"token": token} if token else {}
            self._ask({**first, "reset": dict(reset)})
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
        self._socket.close()

    def _ask(self, message: Message) -> Message:
        try:
            self._lines.send(json.dumps(message).encode())
            line = self._lines.receive(MAX_ANSWER, wait=IDLE)
            answer = None if line is None else _parse(line)
        except (OSError, ValueError) as error:
            text = f"Lost the policy at {self._place}: {error}."
            raise DeviceError(text) from error
        if answer is None:
            raise DeviceError(f"The policy at {self._place} closed the connection.")
        if "error" in answer:
            said = shortened(str(answer["error"]), MAX_ERROR)
            raise DeviceError(f"The policy at {self._place} failed: {said}")
        return answer


class PolicyServer(socketserver.ThreadingTCPServer):
    """Serves policies; `serve_forever` and `shutdown` are those of `socketserver`.

    On a loopback address it has no password: every program of this machine can use the
    policy. On any other address clients need the token in `address`. Size and time of
    messages are bounded; where all connections are taken, the one that waits longest
    for its first message is closed.

    Args:
        begin: Makes the policy of an episode from what a client says of it. Called in a
            thread of each connection. A policy with a method `close` is closed after
            its episode.
        host: Address to listen on.
        port: Port to listen on; 0 for any free one.
        connections: How many clients are served at a time.

    Attributes:
        token: Secret that clients need; None on a loopback address.

    Raises:
        DeviceError: If it cannot listen there.
    """

    allow_reuse_address = True
    daemon_threads = True
    request_queue_size = 128

    def __init__(
        self,
        begin: Begin,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        connections: int = CONNECTIONS,
    ) -> None:
        from wbc_suite.web.server import token_for  # aiohttp takes its time

        self.begin, self.token = begin, token_for(host)
        self.large_messages = threading.BoundedSemaphore(LARGE_AT_ONCE)
        self._most, self._lock = connections, threading.Lock()
        self._begun: dict[socket.socket, bool] = {}
        """Whether each connection has sent a message, in the order of connecting."""
        try:
            super().__init__((host, port), _Connection)
        except (OSError, OverflowError) as error:
            raise DeviceError(f"Cannot listen on {host}:{port}: {error}.") from error

    @property
    def address(self) -> str:
        """What a client gives as its policy."""
        from wbc_suite.web.server import reachable_name

        host, port = self.server_address[:2]
        token = "" if self.token is None else f"{self.token}@"
        return f"{SCHEME}{token}{reachable_name(str(host))}:{port}"

    def verify_request(self, request: Any, client_address: Any) -> bool:
        """Take a connection if there is a place, or a silent one makes room."""
        with self._lock:
            if len(self._begun) >= self._most:
                silent = next(
                    (s for s, begun in self._begun.items() if not begun), None
                )
                if silent is None:
                    with contextlib.suppress(OSError):
                        request.sendall(FULL)
                    return False
                self._begun.pop(silent)
                with contextlib.suppress(OSError):
                    silent.shutdown(socket.SHUT_RDWR)
            self._begun[request] = False
        return True

    def note(self, connection: socket.socket, *, begun: bool) -> None:
        """Note that a connection has sent its first message, or has ended."""
        with self._lock:
            if not begun:
                self._begun.pop(connection, None)
            elif connection in self._begun:
                self._begun[connection] = True


class _Connection(socketserver.BaseRequestHandler):
    begun = False  # whether it has sent a message
    act: Act | None = None

    @property
    def owner(self) -> PolicyServer:
        """The server."""
        assert isinstance(self.server, PolicyServer), "it makes the connections"
        return self.server

    def handle(self) -> None:
        """Answer requests until the client leaves, is silent, or talks nonsense."""
        lines = _Lines(self.request)
        try:
            while (request := self._next(lines)) is not None:
                lines.send(json.dumps(self._answer(*request)).encode())
        except DeviceError as error:
            with contextlib.suppress(OSError):
                lines.send(json.dumps({"error": str(error)}).encode())
        except (OSError, ValueError):
            return
        finally:
            self.owner.note(self.request, begun=False)
            self._end_episode()

    def _next(self, lines: "_Lines") -> tuple[str, Any] | None:
        """Return the next request, None at the end.

        Raises ValueError for nonsense, DeviceError without the token.
        """
        wait = IDLE if self.begun else FIRST
        with ExitStack() as held:
            line = lines.receive(MAX_BYTES, wait, self.owner.large_messages, held)
            if line is None:
                return None
            message = _parse(line)
            if not self.begun:
                self._check_token(message)
                self.owner.note(self.request, begun=True)
                self.begun = True
            reset, seen = message.get("reset"), message.get("observation")
            if isinstance(reset, dict):
                return "reset", reset
            if isinstance(seen, dict):
                return "observation", {key: decode(seen[key]) for key in seen}
        return "neither", None

    def _check_token(self, message: Message) -> None:
        token, given = self.owner.token, str(message.get("token", ""))
        if token is not None and not hmac.compare_digest(
            given.encode(), token.encode()
        ):
            raise DeviceError(
                "This server needs its token: use the whole address that it prints, "
                f"{SCHEME}TOKEN@HOST:PORT."
            )

    def _answer(self, request: str, content: Any) -> Message:
        try:
            if request == "reset":
                self._end_episode()
                self.act = self.owner.begin(content)
                return {}
            if request == "observation" and self.act is not None:
                return {"action": encode(np.asarray(self.act(content)))}
        except Exception as error:  # noqa: BLE001 - the client is told
            return {"error": shortened(f"{type(error).__name__}: {error}", MAX_ERROR)}
        return {"error": "Send a reset first, then observations."}

    def _end_episode(self) -> None:
        ended, self.act = self.act, None
        getattr(ended, "close", lambda: None)()


class _Lines:
    """Lines over a socket, bounded in length and time.

    Methods raise OSError when the connection is lost or a time has passed.
    """

    def __init__(self, connection: socket.socket) -> None:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket, self._received = connection, bytearray()

    def send(self, line: bytes) -> None:
        """Send a line."""
        self._socket.settimeout(TRANSFER)
        self._socket.sendall(line + b"\n")

    def receive(
        self,
        most: int,
        wait: float,
        large: threading.BoundedSemaphore | None = None,
        held: ExitStack | None = None,
    ) -> bytes | None:
        """Return the next line; None at the end.

        Args:
            most: Bytes of a line; a longer one is a ValueError.
            wait: Time until it begins, s.
            large: Acquired for a line of more than `LARGE` bytes.
            held: Releases `large`.
        """
        deadline, searched = time.monotonic() + wait, 0
        while (end := self._received.find(b"\n", searched)) < 0:
            searched = len(self._received)
            if searched > most:
                raise ValueError(f"a message of more than {most} bytes")
            if searched > LARGE and large is not None and held is not None:
                if not large.acquire(timeout=_left(deadline)):
                    raise TimeoutError("too many large messages")
                held.callback(large.release)
                large = None
            self._socket.settimeout(_left(deadline))
            chunk = self._socket.recv(1 << 16)
            if not chunk:
                return None
            if not self._received:
                deadline = time.monotonic() + TRANSFER
            self._received += chunk
        line = bytes(self._received[:end])
        del self._received[: end + 1]
        return line


def _left(deadline: float) -> float:
    """Return the time left, s; TimeoutError if it has passed."""
    left = deadline - time.monotonic()
    if left <= 0.0:
        raise TimeoutError("timed out")
    return left


def _parse(line: bytes) -> Message:
    """Return a message; ValueError if it is none."""
    if sum(map(line.count, (b",", b"[", b"{"))) > MAX_VALUES:  # before memory is taken
        raise ValueError(f"a message of more than {MAX_VALUES} values")
    try:
        message = json.loads(line)
    except RecursionError as error:
        raise ValueError("a message that is nested too deep") from error
    if not isinstance(message, dict):
        raise ValueError("a message is a JSON object")
    return message


def encode(value: Any) -> Message:
    """Return a number or an array as JSON data."""
    array = np.asarray(value)
    little = array.astype(array.dtype.newbyteorder("<"), order="C", copy=False)
    data = base64.b64encode(little.tobytes()).decode("ascii")
    return {"dtype": little.dtype.str, "shape": list(array.shape), "data": data}


def decode(value: Any) -> np.ndarray:
    """Return the array; ValueError if the data is none."""
    try:
        if not DTYPE.fullmatch(value["dtype"]):
            raise ValueError(f"'{value['dtype']!s:.60}' is not a numeric type")
        flat = np.frombuffer(
            base64.b64decode(value["data"], validate=True), value["dtype"]
        )
        return flat.reshape([int(n) for n in value["shape"]]).copy()
    except (TypeError, KeyError, OverflowError) as error:
        raise ValueError(f"not an array: {value!s:.60}") from error
