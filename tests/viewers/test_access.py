import contextlib
import http.client
import socket
import threading

import pytest

from wbc_suite.devices.admission import is_loopback
from wbc_suite.errors import DeviceError
from wbc_suite.viewers.access import AccessGate, Request

TOKEN = "right-token"
PATIENCE = 60.0  # s, for a busy machine


class Upstream:
    """A server that answers every connection with the head it was sent."""

    def __init__(self):
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        self.heads = []
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        with contextlib.suppress(OSError):
            while True:
                connection, _ = self.socket.accept()
                head = connection.recv(65536)
                self.heads.append(head)
                connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 4\r\n\r\npage")
                connection.close()


@pytest.fixture
def upstream():
    server = Upstream()
    yield server
    server.socket.close()


@pytest.fixture
def gate(upstream):
    gate = AccessGate(
        host="127.0.0.1", port=0, upstream=upstream.port, mark="m", token=None
    )
    yield gate
    gate.stop()


@pytest.fixture
def token_gate(upstream):
    gate = AccessGate(
        host="127.0.0.1", port=0, upstream=upstream.port, mark="m", token=TOKEN
    )
    yield gate
    gate.stop()


def get(gate, path="/", method="GET", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", gate.port, timeout=PATIENCE)
    connection.request(
        method, path, headers={k.replace("_", "-"): v for k, v in headers.items()}
    )
    answer = connection.getresponse()
    body = answer.read().decode()
    connection.close()
    return answer, body


def test_own_machine_gets_in_without_a_token(gate, upstream):
    answer, body = get(gate)
    assert (answer.status, body) == (200, "page")
    assert b"X-Wbc-Gate: m\r\n" in upstream.heads[0]


def test_mark_that_a_client_brings_is_taken_out(gate, upstream):
    get(gate, X_WBC_Gate="forged")
    assert b"forged" not in upstream.heads[0]


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
def test_nobody_gets_in_without_the_token(token_gate, upstream, path, headers):
    answer, body = get(token_gate, path, **headers)
    assert answer.status == 401
    assert "token" in body
    assert upstream.heads == []


def test_token_in_the_address_becomes_a_cookie_that_opens(token_gate, upstream):
    answer, _ = get(token_gate, f"/?token={TOKEN}")
    assert answer.status == 303
    assert answer.headers["Location"] == "/"
    cookie = answer.headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Lax" in cookie
    answer, body = get(token_gate, Cookie=cookie.split(";")[0])
    assert (answer.status, body) == (200, "page")


def test_websocket_may_bring_the_token_itself(token_gate):
    answer, _ = get(token_gate, f"/?token={TOKEN}", Upgrade="websocket")
    assert answer.status == 200


def test_page_of_another_site_is_refused(gate, upstream):
    answer, _ = get(gate, Upgrade="websocket", Origin="http://evil.example")
    assert answer.status == 403
    own = f"http://127.0.0.1:{gate.port}"
    assert get(gate, Upgrade="websocket", Origin=own)[0].status == 200
    assert len(upstream.heads) == 1


def test_name_that_points_at_this_machine_is_refused(gate):
    assert get(gate, Host="evil.example")[0].status == 403
    assert get(gate, Host="localhost:8080")[0].status == 200


def test_only_get_is_served(gate):
    assert get(gate, method="POST")[0].status == 405


@pytest.mark.parametrize(
    "sent",
    [
        b"\x00\x01\x02\r\n\r\n",
        b"GET /\r\n\r\n",
        b"GET / HTTP/1.1\r\nno colon\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost : a\r\n\r\n",
        b"GET / HTTP/1.1\r\nX: " + b"a" * 20_000 + b"\r\n\r\n",
    ],
)
def test_unclean_heads_are_refused(gate, upstream, sent):
    with socket.create_connection(("127.0.0.1", gate.port), timeout=PATIENCE) as client:
        client.sendall(sent)
        assert client.recv(4096).startswith(b"HTTP/1.1 4")
    assert upstream.heads == []


def test_gate_outlives_a_hundred_connects(gate):
    for _ in range(100):
        socket.create_connection(("127.0.0.1", gate.port), timeout=PATIENCE).close()
    assert get(gate)[0].status == 200


def test_open_address_needs_a_token():
    with pytest.raises(DeviceError, match="needs a token"):
        AccessGate(host="0.0.0.0", port=0, upstream=1, mark="m", token=None)


def test_taken_port_is_one_clear_error(gate):
    with pytest.raises(DeviceError, match=f"port {gate.port}.*Choose another"):
        AccessGate(host="127.0.0.1", port=gate.port, upstream=1, mark="m", token=None)


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
def test_loopback_addresses_are_told_from_others(host, expected):
    assert is_loopback(host) is expected


def test_header_names_are_read_without_regard_to_case():
    head = b"GET /x HTTP/1.1\r\nHOST: a\r\nUpgrade: WebSocket\r\n\r\n"
    request = Request.parse(head)
    assert request is not None
    assert request.headers["host"] == "a"
    assert request.headers["upgrade"] == "WebSocket"
