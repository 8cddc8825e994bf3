import urllib.request

import pytest
import viser
import websockets
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from wbc_suite.viewers.site import Site

PATIENCE = 60.0  # s, for a busy machine


@pytest.fixture
def site():
    site = Site(port=0)
    yield site
    site.stop()


@pytest.fixture
def open_site():
    site = Site(host="0.0.0.0", port=0)
    yield site
    site.stop()


def socket_to(port, path="/"):
    return connect(
        f"ws://127.0.0.1:{port}{path}",
        subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
        open_timeout=PATIENCE,
    )


def test_page_comes_whole_through_the_gate(site):
    assert site.token is None
    assert site.url == f"http://127.0.0.1:{site.port}/"
    page = urllib.request.urlopen(site.url, timeout=PATIENCE).read()
    assert b"<html" in page
    assert len(page) > 100_000


def test_messages_come_through_the_gate(site):
    with socket_to(site.port) as client:
        assert len(client.recv(timeout=PATIENCE)) > 16


def receive_until_closed(client):
    while True:
        client.recv(timeout=PATIENCE)


def test_walking_around_the_gate_is_refused(site):
    inner = site.server.get_port()
    closed = pytest.raises(websockets.ConnectionClosed, match="gate")
    with socket_to(inner) as client, closed:
        receive_until_closed(client)


def test_open_address_prints_a_token_and_asks_for_it(open_site):
    assert f"?token={open_site.token}" in open_site.url
    assert len(open_site.token) >= 20
    with pytest.raises(websockets.InvalidStatus, match="401"):
        socket_to(open_site.port)
    with socket_to(open_site.port, f"/?token={open_site.token}") as client:
        assert len(client.recv(timeout=PATIENCE)) > 16


def test_share_tunnel_cannot_be_asked_for(site):
    from viser import _messages

    handlers = site.server._websock_server._incoming_handlers
    assert not handlers.get(_messages.ShareUrlRequest)
