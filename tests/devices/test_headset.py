"""The headset's server without a browser: pages, view, access, hostile messages."""

import json
import re
import ssl
import struct
import time
import urllib.error
import urllib.request

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from wbc_suite.devices import make_device
from wbc_suite.devices.headset import FILES, Headset
from wbc_suite.devices.pose_frame import MAX_BYTES
from wbc_suite.errors import ConfigError, DeviceError

PATIENCE = 60.0  # s, for a busy machine
FRAME = '{"format": "wbc-pose-frame/1", "time": %s}'


class FixedView:
    scene = struct.pack("<I", 2) + b"{}"

    def poses(self):
        return np.arange(7, dtype="<f4").tobytes()

    def status(self):
        return json.dumps({"text": "Paused"})


@pytest.fixture
def headset():
    headset = make_device("headset", port=0)
    headset.start()
    yield headset
    headset.stop()


class NoRedirect(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, req, fp, code, msg, headers, newurl):
        return None


def get(url, **options):
    return urllib.request.urlopen(url, timeout=PATIENCE, **options)


def socket_of(headset):
    return connect(headset.url.replace("http", "ws").split("?")[0] + "frames")


def wait_for(condition):
    deadline = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert time.monotonic() < deadline, "nothing came in time"
        time.sleep(0.005)
    return found


def test_every_file_is_served_and_names_no_other_site(headset):
    for name in ("", *FILES[1:], "qr.svg"):
        answer = get(headset.url + name)
        text = answer.read().decode()
        assert len(text) > 100
        if name not in ("three.js", "qr.svg"):
            addresses = set(re.findall(r"(?:https?:)?//[\w.-]+", text))
            assert {a for a in addresses if "localhost" not in a and "127.0" not in a
                    and not a.startswith("// ")} == set()  # fmt: skip
        policies = answer.headers.get_all("Content-Security-Policy")
        assert any("frame-ancestors 'none'" in policy for policy in policies)
        if name != "qr.svg":
            assert any("connect-src 'self'" in policy for policy in policies)
    with pytest.raises(urllib.error.HTTPError, match="404"):
        get(headset.url + "three.LICENSE")


def test_scene_comes_once_there_is_one_and_poses_come_to_who_is_connected(headset):
    assert get(headset.url + "scene").status == 204
    headset.show(FixedView())
    assert get(headset.url + "scene").read() == FixedView.scene
    with socket_of(headset) as socket:
        poses = socket.recv(timeout=PATIENCE)
        assert np.frombuffer(poses, "<f4").tolist() == list(range(7))
        texts = [socket.recv(timeout=PATIENCE) for _ in range(5)]
        assert [t for t in texts if isinstance(t, str)] == ['{"text": "Paused"}']


HOSTILE = (
    "",
    "null",
    "[" * 20_000,
    FRAME % "NaN",
    FRAME % "1e400",
    FRAME % '1, "limbs": {"right": {"pose": {"position": [1e300, 0, 0], '
    '"orientation": [1, 0, 0, 0]}}}',
    FRAME % '1, "limbs": {"right": {"fingers": [[0, 0, 0]]}}',
    FRAME % '1, "limbs": {"right": {"grip": "closed"}}',
    FRAME % '1, "base": [Infinity, 0, 0]',
    b"\xff\xfe\x00",
    "x" * (MAX_BYTES + 1),
)


def test_hostile_messages_cost_their_sender_the_connection_at_most(headset):
    headset.show(FixedView())
    for message in HOSTILE:
        with socket_of(headset) as socket:
            try:
                socket.send(message)
                for _ in range(50):
                    if isinstance(text := socket.recv(timeout=PATIENCE), str):
                        assert "error" in json.loads(text) or "text" in json.loads(text)
                        if "error" in text:
                            break
            except ConnectionClosed:
                pass
        assert headset.read().finite
        assert headset.read().time == 0.0
    with socket_of(headset) as socket:

        def heard():
            socket.send(FRAME % "5")
            return headset.read().time == 5.0

        wait_for(heard)


def test_ways_name_commands_and_addresses(headset):
    port = headset.url.split(":")[2].strip("/")
    text = headset.help
    assert f"adb reverse tcp:{port} tcp:{port}" in text
    assert f"http://localhost:{port}/" in text
    assert "host=0.0.0.0" in text
    assert "--tls-cert" in text
    page = get(headset.url).read().decode()
    assert page.count("<li>") == 3


def test_for_others_it_uses_tls_and_a_token(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    headset = Headset(host="0.0.0.0", port=0)
    headset.start()
    try:
        certificate = tmp_path / "wbc_suite" / "tls" / "certificate.pem"
        trust = ssl.create_default_context(cafile=certificate)
        port = headset.url.split(":")[2].split("/")[0]
        here = f"https://localhost:{port}/"
        with pytest.raises(urllib.error.HTTPError, match="401"):
            get(here, context=trust)
        opener = urllib.request.build_opener(
            urllib.request.HTTPSHandler(context=trust),
            urllib.request.HTTPCookieProcessor(),
        )
        address = f"{here}page.css?token={headset.token}"
        with pytest.raises(urllib.error.HTTPError) as redirect:
            urllib.request.build_opener(
                urllib.request.HTTPSHandler(context=trust), NoRedirect()
            ).open(address, timeout=PATIENCE)
        assert "; Secure" in redirect.value.headers["Set-Cookie"]
        assert b"main canvas" in opener.open(address, timeout=PATIENCE).read()
        assert "█" in headset.help
        assert "SHA-256" in headset.help
        assert headset.url.startswith("https://")
    finally:
        headset.stop()


def test_own_certificate_needs_its_key(tmp_path):
    with pytest.raises(ConfigError, match="together"):
        Headset(tls_cert="certificate.pem")
    missing = str(tmp_path / "missing.pem")
    with pytest.raises(DeviceError, match="cannot be used"):
        Headset(port=0, tls_cert=missing, tls_key=missing).start()
