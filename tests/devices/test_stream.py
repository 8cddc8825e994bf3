"""The stream: frames over WebSocket, and what a server must survive."""

import json
import shutil
import socket
import ssl
import time
import urllib.error
import urllib.request
from contextlib import ExitStack

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from wbc_suite.devices.pose_frame import (
    MAX_BYTES,
    Pose,
    PoseFrame,
    PoseLimb,
)
from wbc_suite.devices.stream import SENDERS, Stream
from wbc_suite.devices.stream_client import StreamClient
from wbc_suite.errors import DeviceError

PATIENCE = 60.0  # s, for a busy machine
FINGERS = [(0.01 * k, 0.0, 0.0) for k in range(25)]


@pytest.fixture
def stream():
    stream = Stream(port=0)
    stream.start()
    yield stream
    stream.stop()


def frame(seconds, **said):
    return PoseFrame(format="wbc-pose-frame/1", time=seconds, **said)


def wait_for(condition, patience=PATIENCE):
    deadline = time.monotonic() + patience
    while not (found := condition()):
        assert time.monotonic() < deadline, "nothing came in time"
        time.sleep(0.005)
    return found


def said_at(stream, seconds):
    def look():
        state = stream.read()
        return state if state.time == seconds else None

    return wait_for(look)


def test_frame_arrives_as_a_state(stream):
    pose = Pose(position=(1.0, 2.0, 3.0), orientation=(0.0, 1.0, 0.0, 0.0))
    right = PoseLimb(pose=pose, engaged=False, grip=[0.5, -1.0], fingers=FINGERS)
    sent = frame(
        7.0,
        limbs={"right": right, "head": PoseLimb(pose=pose)},
        joints={"elbow": 0.3},
        base=(0.1, 0.0, -0.2),
        buttons=["keep"],
    )
    with StreamClient(stream.url) as client:
        client.send(sent)
        state = said_at(stream, 7.0)
    limb = state.limbs["right"]
    np.testing.assert_allclose(limb.pose.translation, [1, 2, 3])
    np.testing.assert_allclose(limb.pose.rotation, np.diag([1, -1, -1]), atol=1e-12)
    assert not limb.engaged
    assert limb.grip.tolist() == [0.5, -1.0]
    assert limb.fingers.shape == (25, 3)
    assert state.joints == {"elbow": 0.3}
    assert state.base.tolist() == [0.1, 0.0, -0.2]
    assert state.buttons == {"keep"}
    assert set(state.limbs) == {"right", "head"}


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        '{"format": "wbc-pose-frame/1", "time": NaN}',
        '{"format": "wbc-pose-frame/1", "time": 1e400}',
        '{"format": "wbc-pose-frame/2", "time": 1}',
        '{"format": "wbc-pose-frame/1", "time": 1, "limbs": {"right": {"pos": 1}}}',
        '{"format": "wbc-pose-frame/1", "time": 1, "base": [1, 2]}',
        '{"format": "wbc-pose-frame/1", "time": 1, "limbs": {"right": {"pose": '
        '{"position": [0, 0, 0], "orientation": [0, 0, 0, 0]}}}}',
        "[" * 20_000,
        "x" * (MAX_BYTES + 1),
    ],
)
def test_bad_frames_are_refused_with_a_reason(text):
    with pytest.raises(DeviceError, match=r"\w+"):
        PoseFrame.parse(text)


def test_sender_of_nonsense_is_told_and_does_no_harm(stream):
    with connect(stream.url.replace("http", "ws") + "frames") as client:
        client.send('{"format": "wbc-pose-frame/1", "time": "soon"}')
        wait_for(lambda: stream.refused)
        assert "time" in json.loads(client.recv(timeout=PATIENCE))["error"]
        client.send(frame(3.0).model_dump_json())
        said_at(stream, 3.0)


def test_a_press_between_two_reads_is_not_lost(stream):
    with StreamClient(stream.url) as client:
        client.send(frame(1.0, buttons=["grip"]))
        client.send(frame(2.0, buttons=["next"]))
        client.send(frame(3.0))
        wait_for(lambda: stream._newest is not None and stream._newest.time == 3.0)
        assert stream.read().buttons == {"grip", "next"}
        client.send(frame(4.0))
        assert said_at(stream, 4.0).buttons == frozenset()


def test_first_sender_holds_until_it_leaves(stream):
    with StreamClient(stream.url) as first, StreamClient(stream.url) as second:
        first.send(frame(1.0))
        said_at(stream, 1.0)
        second.send(frame(2.0))
        assert "Another sender" in second.receive(PATIENCE)["error"]
        assert stream.read().time == 1.0
        first.__exit__(None, None, None)

        def taken_over():
            second.send(frame(3.0))
            return stream.read().time == 3.0

        wait_for(taken_over)


def test_a_silent_sender_gives_way(stream, monkeypatch):
    monkeypatch.setattr("wbc_suite.devices.stream.HOLD", 0.03)
    with StreamClient(stream.url) as lost, StreamClient(stream.url) as back:
        lost.send(frame(1.0))
        said_at(stream, 1.0)

        def taken_up():
            back.send(frame(2.0))
            return stream.read().time == 2.0

        wait_for(taken_up)


@pytest.mark.parametrize("nonsense", ["{}", "", '{"format": "wbc-pose-frame/1"}'])
def test_a_sender_of_nonsense_does_not_lock_the_operator_out(stream, nonsense):
    with StreamClient(stream.url) as hostile, StreamClient(stream.url) as operator:
        for number in range(1, 20):
            hostile._socket.send(nonsense)
            assert "error" in hostile.receive(PATIENCE)
            operator.send(frame(float(number)))
            said_at(stream, float(number))


def test_silent_senders_make_room_for_the_operator(stream):
    with ExitStack() as stack:
        silent = [stack.enter_context(StreamClient(stream.url)) for _ in range(SENDERS)]
        operator = stack.enter_context(StreamClient(stream.url))
        operator.send(frame(1.0))
        said_at(stream, 1.0)
        with pytest.raises(ConnectionClosed, match=r"1013.*Silent"):
            silent[0].receive(PATIENCE)
        later = stack.enter_context(StreamClient(stream.url))
        with pytest.raises(ConnectionClosed, match="1013"):
            silent[1].receive(PATIENCE)
        operator.send(frame(2.0))  # it was not the one to leave
        said_at(stream, 2.0)
        later.send(frame(3.0))
        assert "Another sender" in later.receive(PATIENCE)["error"]


def test_busy_senders_keep_their_places(stream, monkeypatch):
    monkeypatch.setattr("wbc_suite.devices.stream.SENDERS", 1)
    monkeypatch.setattr("wbc_suite.devices.stream.HOLD", PATIENCE)
    with StreamClient(stream.url) as only:
        only.send(frame(1.0))
        said_at(stream, 1.0)
        with pytest.raises(DeviceError, match="503"):
            StreamClient(stream.url)
        only.send(frame(2.0))
        said_at(stream, 2.0)


@pytest.mark.slow
def test_hundred_connects_and_disconnects_and_a_flood_leave_it_working(
    stream, monkeypatch
):
    monkeypatch.setattr("wbc_suite.devices.stream.FLOOD", 100)  # any machine sends that
    for k in range(100):
        client = wait_for(lambda: _connected(stream))
        if k % 2:
            client.send("nonsense")
            client.close()
        else:
            client.socket.shutdown(socket.SHUT_RDWR)  # rudely
    with wait_for(lambda: _connected(stream)) as client:
        assert _flood(client, frame(5.0).model_dump_json()) >= 100
    with wait_for(lambda: _connected(stream)) as client:

        def alive():
            time.sleep(0.02)
            client.send(frame(6.0).model_dump_json())
            return stream.read().time == 6.0

        wait_for(alive)


def _flood(client, message):
    """Send without pause; return how many were sent before the server had enough."""
    for sent in range(50_000):
        try:
            client.send(message)
        except ConnectionClosed as closed:
            return sent if "messages a second" in str(closed) else 0
    raise AssertionError("the flood was never stopped")


def _connected(stream):
    try:
        return connect(stream.url.replace("http", "ws") + "frames", compression=None)
    except InvalidStatus:  # those who left rudely are still counted
        return None


def test_pages_are_served_and_others_are_not(stream):
    page = urllib.request.urlopen(stream.url, timeout=PATIENCE)
    assert b"wbc-pose-frame/1" in page.read()
    assert "default-src 'none'" in page.headers["Content-Security-Policy"]
    with pytest.raises(urllib.error.HTTPError, match="404"):
        urllib.request.urlopen(stream.url + "../frame.py", timeout=PATIENCE)


def test_another_sites_page_is_kept_out(stream):
    with pytest.raises(InvalidStatus, match="403"):
        connect(stream.url.replace("http", "ws") + "frames", origin="http://evil.test")


def test_beyond_this_machine_it_asks_for_the_token():
    stream = Stream(host="0.0.0.0", port=0)
    stream.start()
    try:
        port = stream.url.split(":")[2].split("/")[0]
        near = f"ws://127.0.0.1:{port}/frames"
        with pytest.raises(InvalidStatus, match="401"):
            connect(near)
        with pytest.raises(InvalidStatus, match="401"):
            connect(near + "?token=guess")
        with StreamClient(f"http://127.0.0.1:{port}/?token={stream.token}") as client:
            client.send(frame(2.0))
            said_at(stream, 2.0)
    finally:
        stream.stop()


@pytest.mark.skipif(not shutil.which("openssl"), reason="no openssl to make a key")
def test_tls_key_is_made_once_and_is_this_users_own(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    stream = Stream(port=0, tls=True)
    stream.start()
    key = tmp_path / "wbc_suite" / "tls" / "key.pem"
    assert key.stat().st_mode & 0o077 == 0
    trust = ssl.create_default_context(cafile=key.with_name("certificate.pem"))
    try:
        page = urllib.request.urlopen(stream.url, timeout=PATIENCE, context=trust)
        assert b"wbc-pose-frame/1" in page.read()
    finally:
        stream.stop()
    made = key.read_bytes()
    again = Stream(port=0, tls=True)
    again.start()
    again.stop()
    assert key.read_bytes() == made


def test_without_openssl_it_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(DeviceError, match="install it"):
        Stream(port=0, tls=True).start()


def test_nobody_there_is_a_plain_error():
    with pytest.raises(DeviceError, match="No stream answers"):
        StreamClient("http://127.0.0.1:9/")


def test_schema_names_every_part_of_a_frame():
    properties = PoseFrame.model_json_schema()["properties"]
    assert set(properties) == {
        "format", "time", "limbs", "joints", "base", "height", "buttons",
    }  # fmt: skip
