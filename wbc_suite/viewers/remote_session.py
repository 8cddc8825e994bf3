"""The side of the page's process: a session behind a pipe, and the page itself.

What shows the robot at once is imported first; the page of the session, which takes
seconds to import, while the session is made.
"""

import functools
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any, TypeAlias

import mujoco

from wbc_suite.errors import DeviceError, WbcError
from wbc_suite.robot import load_robot
from wbc_suite.viewers.model_scene import ModelScene, robot_box
from wbc_suite.viewers.page_process import QUERIES, SIGNALS
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.scene_setup import set_camera, set_up_scene

if TYPE_CHECKING:
    import pinocchio as pin

    from wbc_suite.viewers.session_state import SessionInfo, Snapshot
    from wbc_suite.viewers.teleop_session import TeleopSession

Session: TypeAlias = "TeleopSession | RemoteSession"
"""What a page displays and commands. Clients are numbers, one for each open page."""

PROGRESS_PERIOD = 0.2  # s

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


class RemoteSession:
    """A `TeleopSession` in another process; its other methods are those in `COMMANDS`.

    Attributes:
        lost: Set when the session has ended; requests do nothing from then on.
    """

    def __init__(self, pipe: Connection) -> None:
        self.lost = threading.Event()
        self._pipe, self._lock = pipe, threading.Lock()

    def wait(self, show: Callable[[str], None]) -> None:
        """Wait until there is a session; meanwhile show what is being done."""
        while (text := self.call("progress")) is not None:
            if text:
                show(text)
            time.sleep(PROGRESS_PERIOD)
        self.info: SessionInfo = self.call("info")
        self._last: Snapshot = self.call("snapshot")

    @property
    def snapshot(self) -> "Snapshot":
        """The newest state, or the last one before the session was lost."""
        self._last = self.call("snapshot") or self._last
        return self._last

    def grab(self, name: str, client: int, T_world_input: "pin.SE3") -> bool:
        """See `TeleopSession`."""
        return bool(self.call("grab", name, client, T_world_input))

    def drag(self, name: str, client: int, T_world_input: "pin.SE3") -> None:
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


class PreparingPage:
    """Show a robot in its first keyframe until `close`; the server goes on.

    One that cannot be loaded, by its name or file, is not shown.
    """

    def __init__(self, site: PageServer, robot: str, *, label: str) -> None:
        self.server = site.server
        set_up_scene(site, label=label)
        self._text = site.server.gui.add_markdown("")
        self.show("Building the robot and its scene.")
        with suppress(WbcError):  # the session's own error is reported
            self._add(robot)

    def show(self, text: str) -> None:
        """Say what is being done."""
        self._text.content = f"**Getting ready**  \n{text}"

    def close(self) -> None:
        """Remove everything from the page."""
        self.server.scene.reset()
        self.server.gui.reset()

    def _add(self, robot: str) -> None:
        model = load_robot(robot).to_mjspec().compile()
        data = mujoco.MjData(model)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_kinematics(model, data)
        ModelScene(self.server, model).update(data.xpos, data.xquat)
        set_camera(self.server, robot_box(model, data))


def serve(
    pipe: Connection, host: str, port: int | None, label: str, robot: str
) -> None:
    """Serve the page until the session ends: the main function of the process."""
    for number in SIGNALS:  # the session ends this process
        signal.signal(number, signal.SIG_IGN)
    session = RemoteSession(pipe)
    try:
        site = PageServer(host, port)
    except DeviceError as error:
        session.call("failed", str(error))
        return
    preparing = PreparingPage(site, robot, label=label)
    session.call("opened", site.url, site.token)
    from wbc_suite.viewers.teleop_page import TeleopPage  # takes seconds

    session.wait(preparing.show)
    if session.lost.is_set():
        site.stop()
        return
    preparing.close()
    page = TeleopPage(session, site, label=label)
    page.start()
    session.call("ready")
    session.lost.wait()
    page.stop()
