"""The teleoperation page in its own process, away from the control loop.

Drawing a scene for several browsers takes Python's lock, for which the loop would wait
in the middle of a tick. So the page runs in another process, and the methods of
`TeleopSession` are requests through a pipe, handled in order. The page waits for an
answer only where it needs one: fast drags do not wait for the loop.

The process starts before the session is made, which takes seconds, and a minute where
kernels are compiled. Until then the page shows the robot: see `PreparingPage`.
"""

import contextlib
import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from wbc_suite import logs
from wbc_suite.errors import DeviceError
from wbc_suite.viewers.loop_timing import raise_priority

if TYPE_CHECKING:
    from wbc_suite.viewers.teleop_session import TeleopSession

log = logs.logger(__name__)

SIGNALS = (signal.SIGINT, signal.SIGTERM)
QUERIES = ("progress", "info", "snapshot", "grab")
"""Requests of the page that have an answer, for which it waits."""
POLL_PERIOD = 0.05  # s
EXIT_TIMEOUT = 10.0  # s; a page that has not ended by then is killed


class PageProcess:
    """Serve a page from another process, at first of a robot, then of a session.

    Args:
        host: See `PageServer`.
        port: See `PageServer`.
        label: Title of the panel.
        robot: Name or file of the robot that is shown until `attach`.
        on_open: Called in a thread when the page can be opened.

    Attributes:
        url: The address that opens the page; empty until then.
        token: Secret that clients need; None on a loopback address.
        pid: Number of the process.
    """

    def __init__(
        self,
        host: str,
        port: int | None,
        *,
        label: str,
        robot: str = "",
        on_open: Callable[["PageProcess"], None] = lambda _: None,
    ) -> None:
        self.url, self.token = "", None
        self._session: TeleopSession | None = None
        self._error, self._on_open = "", on_open
        self._ready, self._stopping = threading.Event(), threading.Event()
        context = multiprocessing.get_context("spawn")
        self._pipe, remote = context.Pipe()
        arguments = remote, host, port, label, robot
        self._process = context.Process(
            target=_serve, args=arguments, name="page", daemon=True
        )
        with _signals_wait():
            self._process.start()
        self.pid = self._process.pid
        remote.close()
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)
        self._thread.start()

    def attach(self, session: "TeleopSession") -> None:
        """Show a session from now on; wait until the page does so. See `check`."""
        self._session = session
        self._ready.wait()
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
            self._ready.set()

    def _handle_requests(self) -> None:
        while not self._stopping.is_set():
            if self._pipe.poll(POLL_PERIOD):
                if self._session is not None:  # both need Python's lock
                    self._session.timer.idle.wait(POLL_PERIOD)
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
                self._on_open(self)
            case "failed":
                (self._error,) = arguments
            case "progress":
                from wbc_suite.compiling import progress_text  # heavy

                return progress_text() if self._session is None else None
            case "ready":
                self._ready.set()
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
        if self._session is None:
            return
        for status in self._session.snapshot.limbs.values():
            if status.holder is not None:
                self._session.leave(status.holder)
        self._session.quit.set()


def _serve(*arguments: Any) -> None:
    """Serve the page, in its process: this one need not import it."""
    from wbc_suite.viewers.remote_session import serve

    serve(*arguments)


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
