"""The teleoperation page in a process of its own, away from the control loop.

Drawing a scene for several browsers takes Python's lock, and the loop would wait for
it in the middle of a tick. So the page runs elsewhere, and what it asks for and says
goes through a pipe, one after the other: the methods of `Drivable`. It waits only for
answers, so that a hand that is dragged fast never waits for the loop.
"""

import contextlib
import logging
import multiprocessing
import signal
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

import pinocchio as pin

from wbc_suite.errors import DeviceError
from wbc_suite.recording.desk import Wish
from wbc_suite.viewers.drivable import SessionTraits
from wbc_suite.viewers.keeping_time import run_first
from wbc_suite.viewers.snapshot import Snapshot
from wbc_suite.viewers.teleop_session import TeleopSession

__all__ = ["PageProcess", "RemoteSession"]

log = logging.getLogger(__name__)

GLANCE = 0.05  # s; between looks whether the page shall end
FAREWELL = 10.0  # s; a page that has not ended by itself then is killed

TOLD = (
    "drag",
    "release",
    "leave",
    "enable",
    "set_gripper",
    "pause",
    "reset",
    "wish",
)
"""Methods of the session that the page calls without waiting for an answer."""


class PageProcess:
    """Serve a session's page from another process.

    Args:
        session: Session to show.
        host, port: See `Site`.
        label: What the panel is called.

    Attributes:
        url: The address that opens the page.
        token: What people must bring; None on this machine's own address.
    """

    def __init__(
        self, session: TeleopSession, host: str, port: int | None, *, label: str
    ) -> None:
        self.url, self.token = "", None
        self._session, self._trouble = session, ""
        self._opened, self._stopping = threading.Event(), threading.Event()
        self._answers: dict[str, Callable[..., Any]] = {
            "look": lambda: session.snapshot,
            "grab": session.grab,
        }
        self._deeds: dict[str, Callable[..., Any]] = {
            "open": self._open,
            "refuse": self._refuse,
            **{name: getattr(session, name) for name in TOLD},
        }
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=_serve,
            args=(theirs, session.traits, host, port, label),
            name="page",
            daemon=True,
        )
        self._process.start()
        theirs.close()
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)
        self._thread.start()

    def wait(self) -> None:
        """Wait until people can open the page.

        Raises:
            DeviceError: If the port cannot be had, or the page's process ended.
        """
        self._opened.wait()
        self.check()

    def check(self) -> None:
        """Raise a `DeviceError` if the page ended by itself."""
        if self._trouble:
            raise DeviceError(self._trouble)

    def stop(self) -> None:
        """Close the page."""
        self._stopping.set()
        self._thread.join()
        self._process.join(FAREWELL)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _run(self) -> None:
        # Were it stopped while it holds Python's lock, the loop would be too.
        run_first(rank=1)
        try:
            with contextlib.suppress(EOFError, OSError):
                self._answer_until_stopped()
        finally:
            self._pipe.close()  # what the page's process ends at
            if not self._stopping.is_set():
                self._abandon()
            self._opened.set()

    def _answer_until_stopped(self) -> None:
        while not self._stopping.is_set():
            if self._pipe.poll(GLANCE):
                self._session.beat.resting.wait(GLANCE)  # or both want Python's lock
                request, arguments = self._pipe.recv()
                if request in self._answers:
                    self._pipe.send(self._answers[request](*arguments))
                else:
                    self._deeds[request](*arguments)

    def _abandon(self) -> None:
        """Let go of what people held, who see nothing any more, and end the session."""
        self._process.join(FAREWELL)
        self._trouble = self._trouble or (
            f"The page's process ended by itself (exit code {self._process.exitcode})."
        )
        for status in self._session.snapshot.limbs.values():
            if status.holder is not None:
                self._session.leave(status.holder)
        self._session.quit.set()

    def _open(self, url: str, token: str | None) -> None:
        self.url, self.token = url, token
        self._opened.set()

    def _refuse(self, trouble: str) -> None:
        self._trouble = trouble


class RemoteSession:
    """A session in another process, as a page drives it; see `Drivable`.

    Args:
        pipe: To the process with the session.
        traits: What stays as it is of the session.

    Attributes:
        lost: Set when the session is gone; from then on requests do nothing.
    """

    def __init__(self, pipe: Connection, traits: SessionTraits) -> None:
        self.traits = traits
        self.lost = threading.Event()
        self._pipe, self._lock = pipe, threading.Lock()
        self._last: Snapshot = self.ask("look")

    @property
    def snapshot(self) -> Snapshot:
        """How things stand, or stood before the session was lost."""
        self._last = self.ask("look") or self._last
        return self._last

    def grab(self, name: str, client: int, T_world_input: pin.SE3) -> bool:
        """See `Drivable`."""
        return bool(self.ask("grab", name, client, T_world_input))

    def drag(self, name: str, client: int, T_world_input: pin.SE3) -> None:
        """Move a limb's target; whether another holds it is not waited for."""
        arrived = time.perf_counter()  # a clock that all processes share
        self.tell("drag", name, client, T_world_input, arrived)

    def release(self, name: str, client: int) -> None:
        """See `Drivable`."""
        self.tell("release", name, client)

    def leave(self, client: int) -> None:
        """See `Drivable`."""
        self.tell("leave", client)

    def enable(self, name: str, enabled: bool) -> None:
        """See `Drivable`."""
        self.tell("enable", name, enabled)

    def set_gripper(self, name: str, index: int, value: float) -> None:
        """See `Drivable`."""
        self.tell("set_gripper", name, index, value)

    def pause(self, paused: bool) -> None:
        """See `Drivable`."""
        self.tell("pause", paused)

    def reset(self) -> None:
        """See `Drivable`."""
        self.tell("reset")

    def wish(self, wish: Wish) -> None:
        """See `Drivable`."""
        self.tell("wish", wish)

    def ask(self, request: str, *arguments: Any) -> Any:
        """Ask the other process, and wait for its answer; None once it is gone."""
        return self._send(request, arguments, answered=True)

    def tell(self, request: str, *arguments: Any) -> None:
        """Tell the other process, in the order of all that is asked and told."""
        self._send(request, arguments, answered=False)

    def _send(self, request: str, arguments: tuple[Any, ...], *, answered: bool) -> Any:
        with self._lock:
            try:
                self._pipe.send((request, arguments))
                return self._pipe.recv() if answered else None
            except (EOFError, OSError):
                self.lost.set()
                return None


def _serve(
    pipe: Connection,
    traits: SessionTraits,
    host: str,
    port: int | None,
    label: str,
) -> None:
    """Serve the page until the session is gone: the page's process."""
    from wbc_suite.viewers.site import Site
    from wbc_suite.viewers.teleop_page import TeleopPage

    for number in (signal.SIGINT, signal.SIGTERM):  # the session ends it
        signal.signal(number, signal.SIG_IGN)
    session = RemoteSession(pipe, traits)
    if session.lost.is_set():
        return
    try:
        site = Site(host, port)
    except DeviceError as error:
        session.tell("refuse", str(error))
        return
    page = TeleopPage(session, site, label=label)
    page.start()
    session.tell("open", site.url, site.token)
    session.lost.wait()
    page.stop()
