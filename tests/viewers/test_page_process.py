"""The page in a process of its own: driven through it, closed, killed, refused."""

import contextlib
import multiprocessing
import os
import signal
import socket
import threading
import time

import msgspec
import numpy as np
import pinocchio as pin
import pytest
import viser
from fake_env import FakeEnv
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from wbc_suite.errors import DeviceError
from wbc_suite.recording.episode_control import EpisodeCommand
from wbc_suite.viewers.page_process import PageProcess
from wbc_suite.viewers.remote_session import RemoteSession
from wbc_suite.viewers.teleop_session import TeleopSession

PATIENCE = 120.0  # s
HAND = "right_hand"
VISITS, FLOOD = 100, 5_000
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (2.0, 0.0, 1.5),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 600,
    "image_width": 960,
    "look_at": (0.0, 0.0, 1.0),
    "up_direction": (0.0, 0.0, 1.0),
}
"""What a browser says first; it is a client from then on."""


def wait_until(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)


def holder(session):
    session.tick()
    return session.snapshot.limbs[HAND].holder


def pages():
    return [p for p in multiprocessing.active_children() if p.name == "page"]


@pytest.fixture
def session():
    return TeleopSession(FakeEnv(), period=0.02)


@pytest.fixture
def page(session):
    made = PageProcess("127.0.0.1", 0, label="test")
    made.attach(session)
    yield made
    made.stop()
    assert pages() == []


class Person:
    """A client of the page that drags the hand by messages, as a browser sends them.

    Args:
        page: The page.
        number: How many clients it had before.
    """

    def __init__(self, page, number=0):
        self.number = number
        origin = page.url.rstrip("/")
        self.socket = connect(
            origin.replace("http", "ws"),
            origin=origin,
            max_size=None,
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
            open_timeout=PATIENCE,
        )
        self.say(CAMERA)

    def say(self, message):
        self.socket.send(msgspec.msgpack.encode(message))

    def drag(self, phase, **pose):
        handle = {"name": f"/gizmos/{HAND}", "owner": str(self.number)}
        self.say(handle | {"type": f"TransformControls{phase}Message"} | pose)

    def grab(self, session):
        """Grab again until the page has made the handles of this client."""

        def grabbed():
            self.drag("DragStart")
            return holder(session) == self.number

        wait_until(grabbed)


@pytest.mark.slow
def test_a_person_drags_through_the_page_and_lets_go_by_leaving(session, page):
    start = session.snapshot.limbs[HAND].target
    person = Person(page)
    person.grab(session)
    up = (start.translation + np.array([0.0, 0.0, 0.1])).tolist()
    person.drag("Update", position=up, wxyz=[1.0, 0.0, 0.0, 0.0])
    wait_until(lambda: len(session.latencies()) == 1 or holder(session) is None)
    session.tick()
    moved = session.snapshot.limbs[HAND].target.translation - start.translation
    assert moved == pytest.approx([0.0, 0.0, 0.1], abs=1e-6)
    person.socket.close()
    wait_until(lambda: holder(session) is None)


NAN, HUGE = float("nan"), 1e300
HOSTILE = [
    {"position": [NAN, 0, 0], "wxyz": [1, 0, 0, 0]},
    {"position": [0, 0, HUGE], "wxyz": [1, 0, 0, 0]},
    {"position": [0, 0, 1], "wxyz": [NAN, 0, 0, 0]},
    {"position": [0, 0, 1], "wxyz": [0, 0, 0, 0]},
    {"position": [0, 0, 1], "wxyz": [1, 0]},
    {"position": "here", "wxyz": None},
    {},
]
"""Poses of a drag that no browser sends."""


@pytest.mark.slow
def test_session_survives_any_message_and_the_next_viewer_drags(session, page):
    start = session.snapshot.limbs[HAND].target.translation
    for number, pose in enumerate(HOSTILE):
        visitor = Person(page, number)
        visitor.grab(session)
        visitor.drag("Update", **pose)
        with contextlib.suppress(ConnectionClosed):  # the page may hang up at the first
            visitor.socket.send(b"\xff\xfe no msgpack")
            visitor.socket.send("text")
        wait_until(lambda: holder(session) is None)  # the page hung up, or the drag ...
        visitor.socket.close()  # ... was refused
    person = Person(page, len(HOSTILE))
    person.grab(session)
    up = (start + np.array([0.0, 0.0, 0.1])).tolist()

    def moved():
        person.drag("Update", position=up, wxyz=[5.0, 0.0, 0.0, 0.0])
        session.tick()
        target = session.snapshot.limbs[HAND].target
        return target.translation == pytest.approx(up, abs=0.3)

    wait_until(moved)
    page.check()
    assert np.isfinite(session.env.actions).all()
    R = session.snapshot.limbs[HAND].target.rotation
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)


@pytest.mark.slow
def test_page_outlives_a_hundred_visits_and_a_flood(session, page):
    start = session.snapshot.limbs[HAND].target.translation
    for number in range(VISITS):
        visitor = Person(page, number)
        if number % 2:
            visitor.drag("DragStart")
            visitor.socket.close()
        else:
            visitor.socket.socket.shutdown(socket.SHUT_RDWR)  # rudely
    person = Person(page, VISITS)
    person.grab(session)
    for share in np.linspace(0.0, 1.0, FLOOD):
        place = start + np.array([0.0, 0.0, 0.1 * share])
        person.drag("Update", position=place.tolist(), wxyz=[1.0, 0.0, 0.0, 0.0])

    def arrived():
        assert holder(session) == VISITS
        rise = session.snapshot.limbs[HAND].target.translation - start
        return rise[2] == pytest.approx(0.1, abs=1e-6)

    wait_until(arrived)
    page.check()
    other = Person(page, VISITS + 1)
    person.socket.close()
    other.grab(session)


@pytest.mark.slow
def test_page_that_is_killed_lets_go_ends_the_session_and_is_reported(session):
    page = PageProcess("127.0.0.1", 0, label="test")
    page.attach(session)
    Person(page).grab(session)
    (process,) = pages()
    os.kill(process.pid, signal.SIGKILL)
    assert session.quit.wait(PATIENCE)
    assert holder(session) is None
    with pytest.raises(DeviceError, match=r"ended by itself \(exit code -9\)"):
        page.check()
    page.stop()


@pytest.mark.slow
def test_taken_port_is_reported_where_the_page_was_asked_for(session):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        page = PageProcess("127.0.0.1", port, label="test")
        with pytest.raises(DeviceError, match=str(port)):
            page.attach(session)
        page.stop()


def test_remote_session_asks_for_what_the_session_does_and_stands_a_loss(session):
    ours, theirs = multiprocessing.Pipe()
    asked, shown = [], []

    def answer():
        for k in range(12):
            asked.append(ours.recv())
            match asked[-1][0]:
                case "progress":
                    ours.send("Compiling kernels" if k == 0 else None)
                case "info" | "snapshot" as name:
                    ours.send(getattr(session, name))
                case "grab":
                    ours.send(True)
        ours.close()

    thread = threading.Thread(target=answer)
    thread.start()
    remote, here = RemoteSession(theirs), pin.SE3.Identity()
    remote.wait(shown.append)
    assert shown == ["Compiling kernels"]
    assert remote.grab(HAND, 3, here)
    remote.release(HAND, 3)
    remote.leave(3)
    remote.enable(HAND, False)
    remote.set_gripper("right_gripper", 1, 0.5)
    remote.pause(3, True)
    remote.reset()
    remote.command_episode(EpisodeCommand.RECORD)
    thread.join()
    names = [name for name, _ in asked]
    assert names == [
        *(
            "progress",
            "progress",
            "info",
            "snapshot",
            "grab",
            "release",
            "leave",
            "enable",
            "set_gripper",
        ),
        *("pause", "reset", "command_episode"),
    ]
    assert asked[8][1] == ("right_gripper", 1, 0.5)
    assert remote.info.limbs.keys() == session.info.limbs.keys()
    assert not remote.lost.is_set()
    remote.drag(HAND, 3, here)
    assert remote.lost.is_set()
    assert remote.snapshot.limbs.keys() == session.info.limbs.keys()
