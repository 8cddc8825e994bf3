"""viser through its proxy: pages and messages pass, the share tunnel does not."""

import gzip
import os
import stat
import sys
import threading
import urllib.error
import urllib.request

import msgspec
import pytest
import viser
import websockets
import websockets.asyncio.server
from websockets.sync.client import connect
from websockets.sync.server import unix_serve
from websockets.typing import Subprotocol

from tests.listening import listening
from wbc_suite.errors import DeviceError
from wbc_suite.viewers import private_viser
from wbc_suite.viewers.page_server import PageServer, proxy
from wbc_suite.web.server import WebServer

PATIENCE = 60.0  # s, for a busy machine
BIG = b"x" * 5_000_000  # a robot's meshes take a few million bytes


@pytest.fixture
def site():
    site = PageServer(port=0)
    yield site
    site.stop()


@pytest.fixture
def open_site():
    site = PageServer(host="0.0.0.0", port=0)
    yield site
    site.stop()


@pytest.fixture
def echo(tmp_path):
    """The port of a proxy in front of a server that sends every message back."""

    def answer(connection):
        for message in connection:
            if message == "close":
                connection.close(1002, "as asked")
            elif message == "big":
                connection.send(BIG)
            else:
                connection.send(message)

    upstream = unix_serve(
        answer,
        str(tmp_path / "echo"),
        subprotocols=[Subprotocol("b")],
        select_subprotocol=lambda _, offered: offered[-1] if offered else None,
        max_size=None,
    )
    thread = threading.Thread(target=upstream.serve_forever, daemon=True)
    thread.start()
    routes = proxy(tmp_path / "echo", admits=lambda message: message != "bad")
    server = WebServer("127.0.0.1", 0, routes, token=None)
    yield server.port
    server.stop()
    upstream.shutdown()
    thread.join()


def socket_to(port, path="/", protocol=f"viser-v{viser.__version__}"):
    return connect(
        f"ws://127.0.0.1:{port}{path}",
        subprotocols=[Subprotocol(protocol)],
        open_timeout=PATIENCE,
        max_size=None,
    )


def receive_until_closed(client):
    while True:
        client.recv(timeout=PATIENCE)


def test_page_arrives_whole_and_compressed(site):
    assert site.token is None
    assert site.url == f"http://127.0.0.1:{site.port}/"
    with urllib.request.urlopen(site.url, timeout=PATIENCE) as answer:
        page = answer.read()
        assert answer.headers["Content-Type"].startswith("text/html")
    assert b"<html" in page
    assert len(page) > 100_000
    packed = urllib.request.Request(site.url, headers={"Accept-Encoding": "gzip"})
    with urllib.request.urlopen(packed, timeout=PATIENCE) as answer:
        assert answer.headers["Content-Encoding"] == "gzip"
        assert gzip.decompress(answer.read()) == page


def test_missing_files_stay_missing(site):
    for path in ("nothing.js", "..%2f..%2f__init__.py"):
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(site.url + path, timeout=PATIENCE)


def test_messages_of_viser_arrive(site):
    with socket_to(site.port) as client:
        assert len(client.recv(timeout=PATIENCE)) > 16


def test_page_of_another_version_learns_so(site):
    closed = pytest.raises(websockets.ConnectionClosed, match=r"[Vv]ersion")
    with socket_to(site.port, protocol="viser-v0.0.0") as client, closed:
        receive_until_closed(client)


def test_open_address_has_a_token_and_needs_it(open_site):
    assert f"?token={open_site.token}" in open_site.url
    assert len(open_site.token) >= 20
    with pytest.raises(websockets.InvalidStatus, match="401"):
        socket_to(open_site.port)
    with socket_to(open_site.port, f"/?token={open_site.token}") as client:
        assert len(client.recv(timeout=PATIENCE)) > 16


on_linux = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


@on_linux
def test_only_the_proxy_listens_where_others_reach_it():
    before = set(listening(os.getpid()))
    site = PageServer(port=0)
    found = set(listening(os.getpid())) - before
    folder = site.server.path.parent
    mode = stat.S_IMODE(folder.stat().st_mode)
    site.stop()
    assert found == {
        ("tcp", "127.0.0.1", site.port),
        ("unix", str(site.server.path), 0),
    }
    assert mode == 0o700
    assert not folder.exists()


@on_linux
def test_viser_that_listens_elsewhere_is_stopped(monkeypatch):
    """A release of viser that does not call `serve` where this one does."""
    other = type("Module", (), {"serve": None})
    monkeypatch.setattr(private_viser, "websockets_server", other)
    before = set(listening(os.getpid()))
    with pytest.raises(DeviceError, match="listening on a port"):
        PageServer(port=0)
    assert set(listening(os.getpid())) == before


def test_other_servers_of_websockets_are_left_alone(site):
    assert websockets.asyncio.server.serve.__module__ == "websockets.asyncio.server"
    assert isinstance(site.server, viser.ViserServer)


def test_long_name_of_the_temporary_folder_is_told(monkeypatch, tmp_path):
    long = tmp_path / ("x" * 100)
    long.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(long))
    with pytest.raises(DeviceError, match="TMPDIR"):
        PageServer(port=0)


def test_share_tunnel_cannot_be_requested(monkeypatch):
    opened = threading.Event()
    monkeypatch.setattr(
        viser.ViserServer, "request_share_url", lambda *_, **__: opened.set()
    )
    site = PageServer(port=0)
    with socket_to(site.port) as client:
        client.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
        assert not opened.wait(0.5)
    site.stop()


def test_messages_pass_both_ways_with_their_type_order_and_protocol(echo):
    with socket_to(echo, protocol="b") as client:
        assert client.subprotocol == "b"
        sent = ["text", b"\x00binary", "", "big"]
        for message in sent:
            client.send(message)
        received = [client.recv(timeout=PATIENCE) for _ in sent]
        assert received == [*sent[:3], BIG]


@pytest.mark.parametrize("message", ["bad", "x" * 20_000])
def test_bad_message_costs_its_sender_the_connection_and_nobody_else(echo, message):
    with (
        socket_to(echo, protocol="b") as client,
        socket_to(echo, protocol="b") as other,
    ):
        client.send(message)
        with pytest.raises(websockets.ConnectionClosed, match=r"1008|1009"):
            client.recv(timeout=PATIENCE)
        other.send("text")
        assert other.recv(timeout=PATIENCE) == "text"


def test_upload_to_a_slider_is_refused(site):
    """viser keeps what is uploaded to any element in memory."""
    slider = site.server.gui.add_slider(
        "a", min=0.0, max=1.0, step=0.1, initial_value=0
    )
    upload = {
        "type": "FileTransferStartUpload",
        "source_component_uuid": slider._impl.uuid,
        "transfer_uuid": "a",
        "filename": "a",
        "mime_type": "text/plain",
        "part_count": 1000,
        "size_bytes": 500_000_000,
    }
    with socket_to(site.port) as client:
        client.send(msgspec.msgpack.encode(upload))
        with pytest.raises(websockets.ConnectionClosed, match="1008"):
            receive_until_closed(client)


def test_reason_for_which_the_page_server_closes_arrives(echo):
    with socket_to(echo, protocol="b") as client:
        client.send("close")
        with pytest.raises(websockets.ConnectionClosed, match=r"1002.*as asked"):
            client.recv(timeout=PATIENCE)


def test_each_message_of_a_drag_is_relayed_before_the_next_is_sent(echo):
    """Nothing is gathered on the way; benchmarks/teleop_loop.py measures the time."""
    sent = [bytes([k]) * 200 for k in range(60)]
    with socket_to(echo, protocol="b") as client:
        for message in sent:
            client.send(message)
            assert client.recv(timeout=PATIENCE) == message


def test_page_server_that_is_gone_is_a_bad_gateway(tmp_path):
    routes = proxy(tmp_path / "gone", admits=bool)
    server = WebServer("127.0.0.1", 0, routes, token=None)
    try:
        with pytest.raises(urllib.error.HTTPError, match="502"):
            urllib.request.urlopen(f"http://127.0.0.1:{server.port}/", timeout=PATIENCE)
        with pytest.raises(websockets.InvalidStatus, match="502"):
            socket_to(server.port)
    finally:
        server.stop()
