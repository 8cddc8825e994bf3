"""The teleoperation page in its own process, away from the control loop.

Drawing a scene for several browsers takes Python's lock, for which the loop would wait
in the middle of a tick. So the page runs in another process, and the methods of
`TeleopSession` are requests through a pipe, handled in order. The page waits for an
answer only where it needs one: fast drags do not wait for the loop.
"""

import contextlib
import functools
import multiprocessing
import signal
import threading
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import Any, TypeAlias

import pinocchio as pin

from wbc_suite import logs
from wbc_suite.errors import DeviceError
from wbc_suite.viewers.loop_timing import raise_priority
from wbc_suite.viewers.session_state import SessionInfo, Snapshot
from wbc_suite.viewers.teleop_session import TeleopSession

log = logs.logger(__name__)

SIGNALS = (signal.SIGINT, signal.SIGTERM)
POLL_PERIOD = 0.05  # s
EXIT_TIMEOUT = 10.0  # s; a page that has not ended by then is killed

QUERIES = ("info", "snapshot", "grab")
"""Requests that have an answer, for which the page waits."""

COMMANDS = (
    "release",
    "leave",
    "enable",
    "set_gripper",
    "drive",
    "ride",
    "watch_balance",
    "pause",
    "reset",
    "command_episode",
)
"""Methods of the session that the page calls as they are, without an answer."""


class PageProcess:
    """Serve a session's page from another process; for host and port see `PageServer`.

    Attributes:
        url: The address that opens the page.
        token: Secret that clients need; None on a loopback address.
        pid: Number of the process.
    """

    def __init__(
        self, session: TeleopSession, host: str, port: int | None, *, label: str
    ) -> None:
        self.url, self.token = "", None
        self._session, self._error = session, ""
        self._opened, self._stopping = threading.Event(), threading.Event()
        context = multiprocessing.get_context("spawn")
        self._pipe, remote = context.Pipe()
        arguments = remote, host, port, label
        self._process = context.Process(
            target=_serve, args=arguments, name="page", daemon=True
        )
        with _signals_wait():
            self._process.start()
        self.pid = self._process.pid
        remote.close()
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)
        self._thread.start()

    def wait(self) -> None:
        """Wait until the page can be opened; see `check`."""
        self._opened.wait()
        self.check()

    def check(self) -> None:
        """Raise a `DeviceError` if the port is not available, or the process ended."""
        if self._error:
            raise DeviceError(self._error)

    def stop(self) -> None:
        """Close the page."""
        self._stopping.set()
        self._thread.join()
        self._process.join(EXIT_TIMEOUT)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _run(self) -> None:
        # If it were suspended while it holds Python's lock, the loop would be too.
        raise_priority(rank=1)
        try:
            with contextlib.suppress(EOFError, OSError):
                self._handle_requests()
        finally:
            self._pipe.close()  # ends the page's process
            if not self._stopping.is_set():
                self._end_session()
            self._opened.set()

    def _handle_requests(self) -> None:
        while not self._stopping.is_set():
            if self._pipe.poll(POLL_PERIOD):
                self._session.timer.idle.wait(POLL_PERIOD)  # both need Python's lock
                request, arguments = self._pipe.recv()
                answer = None
                try:
                    answer = self._handle(request, *arguments)
                except Exception:
                    log.exception("The page asked for something invalid")
                if request in QUERIES:
                    self._pipe.send(answer)

    def _handle(self, request: str, *arguments: Any) -> Any:
        match request:
            case "opened":
                self.url, self.token = arguments
                self._opened.set()
            case "failed":
                (self._error,) = arguments
            case "info" | "snapshot":
                return getattr(self._session, request)
            case _:
                return getattr(self._session, request)(*arguments)

    def _end_session(self) -> None:
        """Release what clients held, and end the session, after the page is lost."""
        self._process.join(EXIT_TIMEOUT)
        self._error = self._error or (
            f"The page's process ended by itself (exit code {self._process.exitcode})."
        )
        for status in self._session.snapshot.limbs.values():
            if status.holder is not None:
                self._session.leave(status.holder)
        self._session.quit.set()


class RemoteSession:
    """A `TeleopSession` in another process; its other methods are those in `COMMANDS`.

    Attributes:
        lost: Set when the session has ended; requests do nothing from then on.
    """

    def __init__(self, pipe: Connection) -> None:
        self.lost = threading.Event()
        self._pipe, self._lock = pipe, threading.Lock()
        self.info: SessionInfo = self.call("info")
        self._last: Snapshot = self.call("snapshot")

    @property
    def snapshot(self) -> Snapshot:
        """The newest state, or the last one before the session was lost."""
        self._last = self.call("snapshot") or self._last
        return self._last

    def grab(self, name: str, client: int, T_world_input: pin.SE3) -> bool:
        """See `TeleopSession`."""
        return bool(self.call("grab", name, client, T_world_input))

    def drag(self, name: str, client: int, T_world_input: pin.SE3) -> None:
        """See `TeleopSession`; returns before the session has handled it."""
        arrived = time.perf_counter()  # the same clock in all processes
        self.call("drag", name, client, T_world_input, arrived)

    def __getattr__(self, name: str) -> Callable[..., None]:
        """Return a method of `TeleopSession` that sends its call."""
        if name not in COMMANDS:
            raise AttributeError(f"A session in another process has no '{name}'.")
        return functools.partial(self.call, name)

    def call(self, request: str, *arguments: Any) -> Any:
        """Send a request; return the answer of a query, None if the session is lost."""
        with self._lock:
            try:
                self._pipe.send((request, arguments))
                return self._pipe.recv() if request in QUERIES else None
            except (EOFError, OSError):
                self.lost.set()
                return None


Session: TypeAlias = TeleopSession | RemoteSession
"""What a page displays and commands. Clients are numbers, one for each open page."""


@contextlib.contextmanager
def _signals_wait() -> Iterator[None]:
    """Handle Ctrl-C and SIGTERM after the block; a process that it starts has neither.

    A process that is half started when its parent ends, or when Ctrl-C in a terminal
    reaches both, prints a traceback.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    waiting: list[int] = []
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    handlers = [signal.signal(n, lambda k, _: waiting.append(k)) for n in SIGNALS]
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number, handler in zip(SIGNALS, handlers, strict=True):
            signal.signal(number, handler)
    for number in waiting:
        signal.raise_signal(number)


def _serve(pipe: Connection, host: str, port: int | None, label: str) -> None:
    """Serve the page until the session ends: the main function of the process."""
    from wbc_suite.viewers.page_server import PageServer
    from wbc_suite.viewers.teleop_page import TeleopPage

    for number in SIGNALS:  # the session ends this process
        signal.signal(number, signal.SIG_IGN)
    session = RemoteSession(pipe)
    if session.lost.is_set():
        return
    try:
        site = PageServer(host, port)
    except DeviceError as error:
        session.call("failed", str(error))
        return
    page = TeleopPage(session, site, label=label)
    page.start()
    session.call("opened", site.url, site.token)
    session.lost.wait()
    page.stop()
