"""Who may open a page: the gate in front of every server of ours.

viser, which serves the pages, knows neither tokens nor origins. So it listens on this
machine's own address only, and the gate listens where people come. The gate reads the
head of each request, decides, and from then on copies bytes both ways.

Whom it lets in, `Admission` says. The gate marks what it lets through, and viser's side
takes nothing without the mark, so that other users of this machine cannot walk around
the gate.
"""

import asyncio
import contextlib
import threading
from collections.abc import Coroutine, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from types import MappingProxyType

from wbc_suite.devices.admission import Admission, Refusal
from wbc_suite.devices.listening import listen

__all__ = ["MARK", "AccessGate", "Request"]

MARK = "X-Wbc-Gate"  # header with which the gate marks what it lets through
HEAD_LIMIT = 16 * 1024  # bytes; browsers stay far below
HEAD_TIMEOUT = 10.0  # s
CONNECTIONS = 256  # at a time; a browser needs one and, while it loads, a few more
CHUNK = 64 * 1024  # bytes


@dataclass(frozen=True, slots=True)
class Request:
    """The head of an HTTP request; header names are in lower case."""

    method: str
    target: str
    headers: Mapping[str, str]

    @classmethod
    def parse(cls, head: bytes) -> "Request | None":
        """Read a head that ends in an empty line; None when it is not clean HTTP."""
        lines = head.decode("latin-1").split("\r\n")[:-2]
        words = lines[0].split(" ") if lines else []
        if len(words) != 3 or not words[2].startswith("HTTP/1."):
            return None
        headers: dict[str, str] = {}
        for line in lines[1:]:
            name, colon, value = line.partition(":")
            name = name.lower()
            if not colon or not name or name.strip() != name or name in headers:
                return None
            headers[name] = value.strip()
        return cls(words[0], words[1], MappingProxyType(headers))


def _encoded(answer: Refusal) -> bytes:
    """Return a refusal as it goes on the wire."""
    body = answer.text.encode()
    fields = (
        ("Content-Type", "text/plain; charset=utf-8"),
        ("Content-Length", str(len(body))),
        ("Connection", "close"),
        ("Cache-Control", "no-store"),
        *answer.headers,
    )
    head = f"HTTP/1.1 {answer.status.value} {answer.status.phrase}\r\n"
    head += "".join(f"{name}: {value}\r\n" for name, value in fields)
    return head.encode("latin-1") + b"\r\n" + body


class AccessGate:
    """Listen for people, and pass on to the page's server those who may see it.

    Args:
        host: Address to listen on.
        port: Port to listen on; 0 takes a free one.
        upstream: Port on 127.0.0.1 where the page's server listens.
        mark: Secret that marks the requests that are let through.
        token: What people must bring; None when `host` is this machine's own.

    Raises:
        DeviceError: If the port cannot be had, or a token is missing.
    """

    def __init__(
        self, *, host: str, port: int, upstream: int, mark: str, token: str | None
    ) -> None:
        self._upstream, self._mark = upstream, mark
        Admission(host, token, "")  # before anything listens
        self._socket = listen(host, port)
        self.port: int = self._socket.getsockname()[1]
        self._admission = Admission(host, token, f"wbc_token_{self.port}")
        self._open = 0
        self._loop = asyncio.new_event_loop()
        self._stopping = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="gate", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Close the port and every connection."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stopping.set)
            self._thread.join()

    def decide(self, request: Request) -> Refusal | None:
        """Return the answer that keeps a request out, or None to let it in."""
        return self._admission.decide(request.method, request.target, request.headers)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._listen_until_stopped())
        tasks = asyncio.all_tasks(self._loop)
        for task in tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self._loop.close()

    async def _listen_until_stopped(self) -> None:
        serving = await asyncio.start_server(
            self._serve, sock=self._socket, limit=HEAD_LIMIT
        )
        await self._stopping.wait()
        serving.close()

    async def _serve(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self._open += 1
        try:
            # Cancelled only by `stop`, and then there is nobody left to tell.
            quiet = (OSError, EOFError, TimeoutError, asyncio.CancelledError)
            with contextlib.suppress(*quiet):
                await self._answer(reader, writer)
        finally:
            self._open -= 1
            writer.close()

    async def _answer(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        answer, head = await self._judge(reader)
        if answer is not None:
            writer.write(_encoded(answer))
            await writer.drain()
            return
        inner, outer = await asyncio.open_connection("127.0.0.1", self._upstream)
        try:
            outer.write(self._marked(head))
            await _until_first(_copy(reader, outer), _copy(inner, writer))
        finally:
            outer.close()

    async def _judge(
        self, reader: asyncio.StreamReader
    ) -> tuple[Refusal | None, bytes]:
        if self._open > CONNECTIONS:
            return Refusal(HTTPStatus.SERVICE_UNAVAILABLE, "Too many viewers."), b""
        try:
            head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), HEAD_TIMEOUT)
        except asyncio.LimitOverrunError:
            status = HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE
            return Refusal(status, "The request's head is too long."), b""
        request = Request.parse(head)
        if request is None:
            return Refusal(HTTPStatus.BAD_REQUEST, "This is not HTTP."), b""
        return self.decide(request), head

    def _marked(self, head: bytes) -> bytes:
        """Put the gate's mark into a head, and take out one that came with it."""
        first, *fields = head[:-4].split(b"\r\n")
        name = MARK.lower().encode() + b":"
        kept = [field for field in fields if not field.lower().startswith(name)]
        mark = f"{MARK}: {self._mark}".encode()
        return b"\r\n".join([first, *kept, mark, b"", b""])


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while chunk := await reader.read(CHUNK):
        writer.write(chunk)
        await writer.drain()  # a slow reader slows its sender, not the memory's growth


async def _until_first(*copies: Coroutine[None, None, None]) -> None:
    """Run both directions until one ends, then end the other."""
    tasks = [asyncio.ensure_future(copy) for copy in copies]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
