"""Hostile clients on every socket that a command opens; friendly ones serve as proof.

The sockets are found by listing those of the command's processes, so that a new one
without a check fails here. Hostile is who comes from a page of another site, under
another host name or without the token, and who sends what no client of ours sends.
"""

import contextlib
import json
import math
import os
import re
import shutil
import signal
import socket
import ssl
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import msgspec
import numpy as np
import pytest
import viser
import zstandard
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect
from websockets.typing import Subprotocol

import wbc_suite
from tests.listening import listening
from wbc_suite.errors import DeviceError
from wbc_suite.evaluation.policy_socket import SocketPolicy

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="reads /proc"),
]

PATIENCE = 240.0  # s, for a busy machine that compiles
SETTLE = 1.0  # s without news of the scene
STILL, MOVED = 1e-3, 1e-2  # m, or parts of a quaternion
NOBODY = 65534
PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
COMMAND = (sys.executable, "-m", "wbc_suite.cli")
PANDA = ("Lift", "--robots", "Panda")
STREAM = ("--device", "stream", "--device-option", "port=0")
HEADSET = ("--device", "headset", "--device-option", "port=0")
OPEN = ("--host", "0.0.0.0")
ENVIRONMENT = os.environ | {"PYTHONPATH": str(Path(wbc_suite.__file__).parents[1])}
WATCH = """
import signal, time, wbc_suite
signal.signal(signal.SIGINT, signal.default_int_handler)  # where it is ignored
env = wbc_suite.make("Lift", robots="Panda", render_mode="human")
env.reset(seed=0)
print("Press Ctrl-C", flush=True)
time.sleep(1000)
"""
URDF = """<robot name="one">
<link name="base"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="arm"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><sphere radius="0.1"/></geometry></visual></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>
<origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="9" velocity="1"/></joint>
</robot>"""

CAMERA = {
    **{"type": "ViewerCameraMessage", "wxyz": (1.0, 0.0, 0.0, 0.0), "fov": 1.0},
    **{"position": (2.0, 0.0, 1.5), "near": 0.01, "far": 100.0},
    **{"image_height": 600, "image_width": 960},
    **{"look_at": (0.0, 0.0, 1.0), "up_direction": (0.0, 0.0, 1.0)},
}
HAND = "/gizmos/right_hand"
FRAME = {"format": "wbc-pose-frame/1", "time": 1.0}
SCENE = "scene.hdf5"


def packed(kind, **fields):
    return msgspec.msgpack.encode({"type": kind, **fields})


def drag(*position, owner="0"):
    """Return the messages of a drag."""
    handle = {"name": HAND, "owner": owner}
    pose = {"position": position, "wxyz": (1.0, 0.0, 0.0, 0.0)}
    return [
        packed("TransformControlsDragStartMessage", **handle),
        packed("TransformControlsUpdateMessage", **handle, **pose),
    ]


ORDERS = {
    "/": [packed(**{"kind": CAMERA["type"]}, **{k: v for k, v in CAMERA.items()
          if k != "type"}), *drag(0.0, 0.3, 1.2)],
    "/frames": [json.dumps(FRAME | {"limbs": {"hand": {"twist": [9, 0, 0, 0, 0, 0]}},
                                    "base": [1, 0, 0], "buttons": ["reset"]})],
    "/held_keys": ["[1, 1, 1, 1]"],
}  # fmt: skip
"""What moves something, by the path of its WebSocket."""

WRONG = {
    "/": [
        *(drag(x, 0.0, 1.0)[1] for x in (math.nan, math.inf, 1e300)),
        packed("TransformControlsUpdateMessage", name=HAND, owner="0"),
        packed("FileTransferStartUpload", source_component_uuid="a", size_bytes=1e9),
        packed("GuiUpdateMessage", uuid="a", updates={"disabled": True}),
        packed("ShareUrlRequest"),
        *(b"", b"\xff" * 100, b"\xdd" * 20_000, "text"),
    ],
    "/frames": [
        json.dumps(FRAME | {"base": [math.nan, 0, 0]}),
        json.dumps(FRAME | {"base": [math.inf, 0, 0]}),
        json.dumps(FRAME | {"base": [1e300, 0, 0]}),
        json.dumps(FRAME | {"format": "wbc-pose-frame/2", "base": [1, 0, 0]}),
        *("", "{}", "[" * 20_000, b"\xff\xfe", "x" * 100_000),
    ],
    "/held_keys": ["[NaN, 0, 0, 0]", "[1]", "[" * 100, b"\xff", "x" * 1_000],
}
"""What an admitted client may not send."""


def foreign(port, *, https):
    """Return host name, origin and headers of requests from elsewhere.

    They reach a server without a token by the browser of its own user.
    """
    scheme = "https" if https else "http"
    here = f"127.0.0.1:{port}"
    return [
        (here, "http://evil.example", {}),
        (here, "null", {}),
        (here, f"{scheme}://127.0.0.1:{port + 1}", {}),
        (here, f"{scheme}://127.0.0.1:{port}.evil.example", {}),
        (here, f"{scheme}://evil.example@127.0.0.1", {}),
        (f"evil.example:{port}", "http://evil.example", {}),
        ("evil.example", None, {}) if not https else (here, "http://x", {}),
        (here, None, {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Dest": "iframe"}),
        (here, None, {"Sec-Fetch-Site": "same-site", "Sec-Fetch-Dest": "empty"}),
    ]


def without_token(port, *, https):
    """Return the same of requests that lack the token only."""
    here = f"127.0.0.1:{port}"
    own = f"{'https' if https else 'http'}://{here}"
    cookies = (f"wbc_token_{port}=", f"wbc_token_{port}=guess", "token=guess; \x01")
    return [
        (here, None, {}),
        (here, own, {}),
        *((here, own, {"Cookie": cookie}) for cookie in cookies[:2]),
        (here, own, {"Authorization": "Bearer guess", "Sec-Fetch-Site": "none"}),
    ]


class Served:
    """A command that runs, with what it printed."""

    def __init__(self, *words, cwd):
        self.process = subprocess.Popen(
            words, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            env=ENVIRONMENT | {"XDG_CONFIG_HOME": str(cwd)},
        )  # fmt: skip
        self.lines = []
        threading.Thread(target=self._read, daemon=True).start()
        deadline = time.monotonic() + PATIENCE
        while not any("Press Ctrl-C" in line for line in self.lines):
            assert self.process.poll() is None, "".join(self.lines)
            assert time.monotonic() < deadline, "".join(self.lines)
            time.sleep(0.1)

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line)

    @property
    def said(self):
        return "".join(self.lines)

    def address(self, port):
        """Return the printed address with a port."""
        return re.search(rf"\w+://[^\s`]*:{port}\S*", self.said)[0]

    def end(self):
        self.process.send_signal(signal.SIGINT)
        self.process.wait(PATIENCE)
        self.process.stdout.close()


class Attack:
    """Hostile clients of one TCP socket.

    Attributes:
        tries: How often something was tried.
        breaches: What succeeded.
    """

    def __init__(self, port, *, https):
        self.port, self.https = port, https
        self.tries, self.breaches = 0, []

    def open(self):
        connection = socket.create_connection(("127.0.0.1", self.port), timeout=5.0)
        if not self.https:
            return connection
        context = ssl.create_default_context()
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        return context.wrap_socket(connection)

    def websocket(self, path, host, origin, headers):
        """Try to open a WebSocket; return what it says after orders."""
        return connect(
            f"ws://{host}{path}",
            sock=self.open(),
            origin=origin,
            additional_headers=headers,
            subprotocols=[PROTOCOL] if path.partition("?")[0] == "/" else None,
            max_size=None,
            open_timeout=10.0,
        )

    def order(self, path, host, origin, headers, *, query=""):
        """Give orders through a WebSocket that must not open."""
        self.tries += 1
        with (
            contextlib.suppress(OSError, WebSocketException),
            self.websocket(path + query, host, origin, headers) as client,
        ):
            self.breaches.append((path + query, host, origin, headers))
            for message in ORDERS[path]:
                client.send(message)
            client.recv(timeout=0.5)

    def request(self, data, *, allowed=b"never"):
        """Send bytes; no page, file or action may come back."""
        self.tries += 1
        answer = b""
        with contextlib.suppress(OSError), self.open() as client:
            client.settimeout(0.5)
            client.sendall(data)
            while len(answer) < 100_000 and (more := client.recv(1 << 16)):
                answer += more
        told = answer.partition(b"\r\n")[0]
        if b" 200" in told or b'"action"' in answer or b"101 Switching" in told:
            self.breaches.append((data[:200], answer[:200]))

    def misbehave(self, path, origin):
        """Send what no page sends, over connections that are admitted."""
        for message in WRONG[path]:
            self.tries += 1
            with contextlib.suppress(OSError, WebSocketException, TimeoutError):
                host = f"127.0.0.1:{self.port}"
                with self.websocket(path, host, origin, {}) as client:
                    client.send(message)
                    deadline = time.monotonic() + 0.3
                    while time.monotonic() < deadline:
                        client.recv(timeout=0.3)


def requests_from_elsewhere(origins):
    """Return HTTP requests that must not be answered by a page or a file."""
    found = []
    for host, origin, headers in origins:
        lines = [f"Host: {host}", *(f"{k}: {v}" for k, v in headers.items())]
        lines += [] if origin is None else [f"Origin: {origin}"]
        for path in ("/", "/page.js", "/scene", "/main.js"):
            text = "\r\n".join([f"GET {path} HTTP/1.1", *lines, "Connection: close"])
            found.append(f"{text}\r\n\r\n".encode())
    return found


def garbage(port):
    here = f"Host: 127.0.0.1:{port}\r\n".encode()
    upgrade = b"Upgrade: websocket\r\nConnection: Upgrade\r\n"
    return [
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + b"x" * 500,
        b"\x00" * 5_000 + b"\n",
        b"GET /\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + here + here + b"\r\n",
        b"GET http://evil.example/ HTTP/1.1\r\nHost: evil.example\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: evil.example\r\nX-Forwarded-" + here + b"\r\n",
        b"POST / HTTP/1.1\r\n" + here + b"Content-Length: 3\r\n"
        b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\nGET / HTTP/1.1\r\n\r\n",
        b"CONNECT 127.0.0.1:22 HTTP/1.1\r\n" + here + b"\r\n",
        b"OPTIONS / HTTP/1.1\r\n" + here + b"Origin: http://evil.example\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + here + upgrade + b"Origin: http://evil.example\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"[" * 200_000 + b"\n",
    ]


def policy_requests(fifo, *, token):
    """Return requests to a policy's socket that no client of ours sends.

    Without its token, if it has one, no episode begins either.
    """
    lift = {"seed": 0, "benchmark": "Lift", "robots": "Panda"}
    named = ({"robots": fifo}, {"benchmark": fifo}, {"controller_configs": fifo})
    named += ({"arena": fifo}, {"gripper_types": fifo}, {"benchmark": "os:system"})
    resets = [json.dumps({"reset": lift | each}).encode() + b"\n" for each in named]
    observe = b'{"observation": {}}\n'
    lacking = ({}, {"token": ""}, {"token": "guess"}, {"token": None}, {"token": [1]})
    begun = [json.dumps(each | {"reset": lift}).encode() + b"\n" for each in lacking]
    return [
        *(reset + observe for reset in begun if token),
        *(reset + observe for reset in resets),
        observe,
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" + resets[0] + observe,
        b'{"reset": ' * 10_000 + b"\n" + observe,
        b'{"reset": [' + b"1," * 100_000 + b"1]}\n" + observe,
        b'{"reset": {"seed": "NaN"}}\n' + observe,
        b'{"token": "guess", "reset": {}}\n' + observe,
    ]


def attack(served, listener, fifo):
    """Run all hostile clients against a TCP socket."""
    address = served.address(listener.port)
    made = Attack(listener.port, https=address.startswith("https"))
    for data in garbage(listener.port):
        made.request(data)
    if address.startswith("socket://"):
        for data in policy_requests(fifo, token="@" in address):
            made.request(data)
    elif "?token=" in address:
        attack_with_token(made)
    else:
        attack_from_elsewhere(made, foreign(listener.port, https=made.https))
        for path in WRONG:
            made.misbehave(path, address.rstrip("/"))
    return made


def attack_with_token(made):
    """Run the clients that a token keeps out, besides those from elsewhere."""
    lacking = without_token(made.port, https=made.https)
    attack_from_elsewhere(made, [*foreign(made.port, https=made.https), *lacking])
    for path in ORDERS:
        for query in ("?token=", "?token=guess", "?Token=x&token=%00"):
            made.order(path, *lacking[-1], query=query)


def attack_from_elsewhere(made, origins):
    """Run clients with a host name, an origin and headers each."""
    for path in ORDERS:
        for origin in origins:
            made.order(path, *origin)
    for data in requests_from_elsewhere(origins):
        made.request(data)


def private(path):
    """Check that nobody else can connect to a Unix socket; return the tries."""
    folder = Path(path).parent.stat()
    assert stat.S_IMODE(folder.st_mode) == 0o700, path
    assert folder.st_uid == os.getuid()
    if os.getuid() != 0:
        return 0
    script = f"import socket\nsocket.socket(socket.AF_UNIX).connect({path!r})"
    words = ["/usr/bin/python3", "-I", "-c", script]
    tried = subprocess.run(
        words, user=NOBODY, group=NOBODY, extra_groups=[], capture_output=True,
        check=False,
    )  # fmt: skip
    assert b"PermissionError" in tried.stderr, tried.stderr
    return 1


class Viewer:
    """A friendly client of a page: where everything is in its scene."""

    def __init__(self, address):
        host = re.search(r":(\d+)/", address)[1]
        _, _, query = address.partition("?")
        self.places, self.number = {}, None
        self._socket = connect(
            f"ws://127.0.0.1:{host}/?{query}",
            origin=f"http://127.0.0.1:{host}",
            subprotocols=[PROTOCOL],
            max_size=None,
        )
        self.send(ORDERS["/"][0])

    def send(self, *messages):
        for message in messages:
            self._socket.send(message)

    def look(self):
        """Return position and orientation of every node, once they rest."""
        changed, deadline = time.monotonic(), time.monotonic() + PATIENCE
        while time.monotonic() < min(changed + SETTLE, deadline):
            with contextlib.suppress(TimeoutError):
                for message in unpacked(self._socket.recv(timeout=0.1)):
                    changed = max(changed, self._take(message))
        return dict(self.places)

    def _take(self, message):
        """Keep the place that a message tells; return when it last changed."""
        name = message.get("name", "")
        if name == HAND and message.get("owner"):
            self.number = message["owner"]
        key = {"SetPositionMessage": "position", "SetOrientationMessage": "wxyz"}
        field = key.get(message["type"])
        if field is None or not name.startswith(("/world", "/gizmos", "/robot")):
            return 0.0
        place = np.array(message[field])
        before = self.places.get((name, field))
        self.places[name, field] = place
        still = before is not None and np.abs(place - before).max() < STILL / 10
        return 0.0 if still else time.monotonic()

    def close(self):
        self._socket.close()


def unpacked(data):
    """Return the messages in a frame of viser's."""
    whole, size = (int.from_bytes(data[k : k + 8], "little") for k in (0, 8))
    text = zstandard.ZstdDecompressor().decompress(data[16 : 16 + size], whole)
    return msgspec.msgpack.decode(text)["messages"]


def farthest(places, others):
    return max(
        (float(np.abs(places[k] - others[k]).max()) for k in places.keys() & others),
        default=0.0,
    )


def try_stream(address):
    """Send a frame as a friendly client."""
    port = re.search(r":(\d+)/", address)[1]
    _, _, query = address.partition("?")
    context = None
    if address.startswith("https"):
        context = ssl.create_default_context()
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    scheme = "ws" if context is None else "wss"
    url = f"{scheme}://127.0.0.1:{port}/frames?{query}"
    with connect(url, ssl=context, max_size=None) as client:
        client.send(json.dumps(FRAME))
        with contextlib.suppress(TimeoutError):
            for _ in range(30):  # a headset's page gets the scene all the time
                said = client.recv(timeout=0.5)
                assert isinstance(said, bytes) or "error" not in json.loads(said), said


def try_policy(address):
    """Play a step as a friendly client."""
    place = re.sub(r"@[^:]*:", "@127.0.0.1:", address)
    policy = SocketPolicy(place, {"seed": 0, "benchmark": "Lift", "robots": "Panda"})
    assert np.isfinite(policy({})).all()
    policy.close()


COMMANDS = {
    "view": ((*COMMAND, "view", "Panda", "--port", "0"), 1),
    "adopt": ((*COMMAND, "adopt", "one.urdf", "--port", "0"), 1),
    "replay": (
        (*COMMAND, "replay", SCENE, "--show", "browser", "--port", "0"),
        1,
    ),
    "teleop, stream": ((*COMMAND, "teleop", *PANDA, *STREAM, "--port", "0"), 2),
    "teleop, headset": ((*COMMAND, "teleop", *PANDA, *HEADSET, "--port", "0"), 2),
    "record, stream": (
        (*COMMAND, "record", *PANDA, *STREAM, "--out", "new.hdf5", "--port", "0"),
        2,
    ),
    "watch": ((sys.executable, "-c", WATCH), 1),
    "serve-policy": ((*COMMAND, "serve-policy", "hold", "--port", "0"), 1),
    "view, open": ((*COMMAND, "view", "Panda", *OPEN, "--port", "0"), 1),
    "teleop, headset, open": (
        (*COMMAND, "teleop", *PANDA, *HEADSET, "--device-option", "host=0.0.0.0",
         *OPEN, "--port", "0"),
        2,
    ),
    "serve-policy, open": (
        (*COMMAND, "serve-policy", "hold", *OPEN, "--port", "0"),
        1,
    ),
}  # fmt: skip
"""Commands that open sockets, and how many of them others can reach."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a robot, a recording and a pipe that nobody writes into."""
    folder = tmp_path_factory.mktemp("served")
    (folder / "one.urdf").write_text(URDF)
    os.mkfifo(folder / "pipe.toml")
    words = (*COMMAND, "record", *PANDA, "--device", "hold", "--horizon", "5")
    words += ("--episodes", "1", "--executor", "serial", "--out", SCENE)
    subprocess.run(words, cwd=folder, env=ENVIRONMENT, check=True)
    return folder


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", COMMANDS)
def test_hostile_clients_neither_read_nor_move_anything(name, folder):
    if "headset, open" in name and not shutil.which("openssl"):
        pytest.skip("no openssl to make a key")
    words, reachable = COMMANDS[name]
    served = Served(*words, cwd=folder)
    try:
        listeners = listening(served.process.pid)
        assert {listener.kind for listener in listeners} <= {"tcp", "unix"}, listeners
        tcp = [listener for listener in listeners if listener.kind == "tcp"]
        assert len(tcp) == reachable, listeners
        tries = sum(private(listener.host) for listener in listeners
                    if listener.kind == "unix")  # fmt: skip
        addresses = [served.address(listener.port) for listener in tcp]
        devices = [a for a in addresses if a in device_lines(served.said)]
        pages = [a for a in addresses if a not in devices and a.startswith("http")]
        viewers = [Viewer(address) for address in pages]
        before = [viewer.look() for viewer in viewers]
        attacks = [attack(served, each, str(folder / "pipe.toml")) for each in tcp]
        assert [breach for each in attacks for breach in each.breaches] == []
        tries += sum(each.tries for each in attacks)
        after = [viewer.look() for viewer in viewers]
        moves = [farthest(*pair) for pair in zip(before, after, strict=True)]
        print(f"{name}: {listeners}, {tries} tries, 0 of them successful; {moves} m")
        assert max(moves, default=0.0) < STILL
        assert served.process.poll() is None
        for address in devices:
            try_stream(address)
        for address in addresses:
            if address.startswith("socket://"):
                try_policy(address)
        for viewer, places in zip(viewers, after, strict=True):
            prove(viewer, places)
        assert "Traceback" not in served.said
        assert served.said.replace("\n", "").isprintable()
    finally:
        served.end()


def device_lines(said):
    """Return the addresses that devices print."""
    return re.findall(r"(?:Stream|Headset): open (\S+)", said)


def prove(viewer, places):
    """Check that a friendly drag is seen, where there is a hand to drag."""
    assert places
    if (HAND, "position") in places:
        x, y, z = places[HAND, "position"]
        time.sleep(1.5)  # until the device that moved last has let go
        viewer.send(*drag(float(x), float(y) + 0.1, float(z), owner=viewer.number))
        assert farthest(places, viewer.look()) > MOVED
    viewer.close()


def test_a_policy_server_that_is_gone_is_told():
    """A friendly client fails where there is nobody: the proofs above are proofs."""
    with pytest.raises(DeviceError):
        try_policy("socket://127.0.0.1:9")
