"""Access over real sockets: who is admitted, and what a server must survive."""

import contextlib
import http.client
import socket
import time

import pytest
from aiohttp import web

from wbc_suite.errors import DeviceError
from wbc_suite.web import server as web_server
from wbc_suite.web.server import WebServer, is_loopback

TOKEN = "right-token"
PATIENCE = 60.0  # s, for a busy machine


def serve(served, token=None, host="127.0.0.1", port=0):
    async def page(request):
        served.append(request)
        return web.Response(text="page")

    route = web.get("/{path:.*}", page, allow_head=False)
    return WebServer(host, port, [route], token=token)


@pytest.fixture
def served():
    return []


@pytest.fixture
def server(served):
    server = serve(served)
    yield server
    server.stop()


@pytest.fixture
def token_server(served):
    server = serve(served, TOKEN)
    yield server
    server.stop()


def get(server, path="/", method="GET", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=PATIENCE)
    connection.request(
        method, path, headers={k.replace("_", "-"): v for k, v in headers.items()}
    )
    answer = connection.getresponse()
    body = answer.read().decode()
    connection.close()
    return answer, body


def client_of(server):
    return socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE)


def is_closed(client):
    try:
        return client.recv(4096) == b""
    except ConnectionResetError:
        return True


def test_loopback_client_is_admitted_without_a_token(server):
    answer, body = get(server)
    assert (answer.status, body) == (200, "page")


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/", {}),
        ("/?token=wrong", {}),
        ("/?token=", {}),
        ("/", {"Cookie": "wbc_token_1=right-token"}),
        ("/", {"Upgrade": "websocket", "Connection": "Upgrade"}),
    ],
)
def test_client_without_the_token_is_refused(token_server, served, path, headers):
    answer, body = get(token_server, path, **headers)
    assert answer.status == 401
    assert "token" in body
    assert served == []


def test_token_in_the_address_becomes_a_cookie_that_admits(token_server):
    answer, _ = get(token_server, f"/?token={TOKEN}")
    assert answer.status == 303
    assert answer.headers["Location"] == "/"
    cookie = answer.headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Lax" in cookie
    assert "Secure" not in cookie  # it is plain HTTP
    answer, body = get(token_server, Cookie=cookie.split(";")[0])
    assert (answer.status, body) == (200, "page")


@pytest.mark.parametrize("path", ["//evil.example/x", "/\\evil.example", "http://e.x/"])
def test_redirect_with_the_cookie_stays_on_this_host(token_server, path):
    answer, _ = get(token_server, f"{path}?token={TOKEN}")
    assert answer.status == 303
    assert not answer.headers["Location"].startswith(("//", "/\\", "http"))


def test_websocket_may_carry_the_token_itself(token_server):
    answer, _ = get(token_server, f"/?token={TOKEN}", Upgrade="websocket")
    assert answer.status == 200


def test_page_of_another_site_is_refused(server, served):
    answer, _ = get(server, Upgrade="websocket", Origin="http://evil.example")
    assert answer.status == 403
    own = f"http://127.0.0.1:{server.port}"
    assert get(server, Upgrade="websocket", Origin=own)[0].status == 200
    assert len(served) == 1


@pytest.mark.parametrize(
    ("site", "loads", "status"),
    [
        ("cross-site", "iframe", 403),
        ("same-site", "iframe", 403),  # another port of this machine
        ("cross-site", "image", 403),
        ("cross-site", "script", 403),
        ("cross-site", "document", 200),  # a link to the page
        ("none", "document", 200),
        ("same-origin", "script", 200),
    ],
)
def test_pages_of_other_sites_may_link_but_not_load(server, site, loads, status):
    asked = {"Sec_Fetch_Site": site, "Sec_Fetch_Dest": loads}
    assert get(server, **asked)[0].status == status


@pytest.mark.parametrize("origin", ["null", "http://[", "\x9b31m", "//", ""])
def test_what_is_no_origin_is_refused(server, caplog, origin):
    assert get(server, Origin=origin)[0].status == 403
    assert caplog.text.replace("\n", "").isprintable()


@pytest.mark.parametrize("path", ["/", "/missing", "/?token=wrong"])
def test_every_answer_keeps_the_page_out_of_frames(token_server, path):
    for cookie in ("", f"wbc_token_{token_server.port}={TOKEN}"):
        headers = get(token_server, path, Cookie=cookie)[0].headers
        assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
        assert headers["X-Frame-Options"] == "DENY"
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Referrer-Policy"] == "no-referrer"
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"


def test_name_that_points_at_this_machine_is_refused(server):
    assert get(server, Host="evil.example")[0].status == 403
    assert get(server, Host="localhost:8080")[0].status == 200


@pytest.mark.parametrize("method", ["POST", "HEAD", "OPTIONS", "CONNECT", "TRACE"])
def test_only_get_is_served(server, served, method):
    assert get(server, method=method)[0].status in (400, 405)
    assert served == []


@pytest.mark.parametrize(
    "sent",
    [
        b"\x00\x01\x02\r\n\r\n",
        b"GET /\r\n\r\n",
        b"GET / HTTP/1.1\r\nno colon\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost : a\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + b"a" * 20_000 + b"\r\n\r\n",
        b"GET /" + b"a" * 20_000 + b" HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
    ],
)
def test_malformed_and_oversized_requests_are_refused(server, served, sent):
    with client_of(server) as client:
        client.sendall(sent)
        status = client.recv(4096).split(b" ")[1]
        assert status.startswith(b"4")
    assert served == []
    assert get(server)[0].status == 200


def test_server_outlives_a_hundred_connects(server):
    for _ in range(100):
        client_of(server).close()
    assert get(server)[0].status == 200


def test_connection_beyond_the_limit_closes_the_one_that_waits_longest(
    server, monkeypatch
):
    monkeypatch.setattr(web_server, "CONNECTIONS", 3)
    waiting = []
    for _ in range(4):
        waiting.append(client_of(server))
        time.sleep(0.05)  # until the server has accepted it
    assert is_closed(waiting[0])
    for client in waiting[1:]:
        client.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        assert client.recv(4096).startswith(b"HTTP/1.1 200")
    with client_of(server) as fifth:  # all others have been answered
        assert is_closed(fifth)
    for client in waiting:
        client.close()
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:  # the server learns of closing later
        try:
            assert get(server)[0].status == 200
            return
        except (ConnectionError, http.client.RemoteDisconnected):
            time.sleep(0.01)
    raise AssertionError("closed connections are still counted")


def test_slow_connections_do_not_lock_visitors_out(served, monkeypatch):
    """The one that waits longest for its first request makes room; none times out."""
    monkeypatch.setattr(web_server, "HEAD_TIMEOUT", 1e6)
    server = serve(served)
    slow = [client_of(server) for _ in range(300)]
    for client in slow:
        with contextlib.suppress(OSError):
            client.sendall(b"GET / HTTP/1.1\r\n")
    assert get(server)[0].status == 200
    for client in slow:
        client.close()
    server.stop()


def test_connection_without_a_request_is_closed_after_a_while(served, monkeypatch):
    monkeypatch.setattr(web_server, "HEAD_TIMEOUT", 0.05)
    server = serve(served)
    with client_of(server) as silent, client_of(server) as slow:
        slow.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
        assert is_closed(silent)
        assert is_closed(slow)
    server.stop()
    assert served == []


def test_stop_closes_the_port_and_open_connections(served):
    server = serve(served)
    with client_of(server) as client:
        client.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        answer = b""
        while b"page" not in answer:
            answer += client.recv(4096)
        server.stop()
        assert is_closed(client)
    with pytest.raises(ConnectionRefusedError):
        client_of(server)


def test_open_address_needs_a_token(served):
    with pytest.raises(DeviceError, match="needs a token"):
        serve(served, host="0.0.0.0")


def test_taken_port_is_one_clear_error(server):
    with pytest.raises(DeviceError, match=f"port {server.port}.*Choose another"):
        serve([], port=server.port)


@pytest.mark.parametrize(
    ("host", "expected"),
    [
        ("127.0.0.1", True),
        ("127.8.8.8", True),
        ("::1", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("192.168.1.4", False),
        ("localhost.evil.example", False),
    ],
)
def test_loopback_addresses_are_recognised(host, expected):
    assert is_loopback(host) is expected
