"""Held keys: the script is in the page, and its messages arrive, or end the motion."""

import json
import threading
import time
import urllib.request

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from wbc_suite.viewers.drive_panel import pad_html, velocity_html
from wbc_suite.viewers.held_keys import SOCKET, parse_axes
from wbc_suite.viewers.page_server import PageServer

PATIENCE = 30.0  # s, for a busy machine


class Listener:
    """Keeps what clients send."""

    def __init__(self):
        self.received, self.changed = [], threading.Condition()

    def __call__(self, client, axes):
        with self.changed:
            self.received.append((client, None if axes is None else axes.tolist()))
            self.changed.notify_all()

    def wait(self, count):
        with self.changed:
            done = self.changed.wait_for(
                lambda: len(self.received) >= count, timeout=PATIENCE
            )
        assert done, self.received
        return self.received


@pytest.fixture
def site():
    site = PageServer(port=0)
    yield site
    site.stop()


@pytest.fixture
def listener(site):
    listener = Listener()
    site.keys.listen(listener)
    return listener


def fetch(url):
    with urllib.request.urlopen(url, timeout=PATIENCE) as answer:
        return answer.read().decode()


def socket_of(site):
    return site.url.replace("http", "ws").rstrip("/") + SOCKET


def test_script_comes_before_all_others_and_is_served(site):
    page = fetch(site.url)
    assert page.index('<script src="/held_keys.js">') == page.index("<script")
    assert "addEventListener" in fetch(site.url.rstrip("/") + "/held_keys.js")


def test_client_is_disconnected_until_somebody_listens(site):
    with connect(socket_of(site)) as socket, pytest.raises(ConnectionClosed):
        socket.recv(timeout=PATIENCE)
    site.keys.listen(listener := Listener())
    with connect(socket_of(site)) as socket:
        socket.send("[0, 0, 0, 0]")
        assert listener.wait(1)[0][1] == [0, 0, 0, 0]


def test_axes_arrive_and_a_client_that_goes_ends_its_motion(site, listener):
    with connect(socket_of(site)) as socket:
        socket.send(json.dumps([1, 0, -0.5, 0]))
        socket.send(json.dumps([0, 7, 0, 0]))
        assert listener.wait(2)[:2] == [(-1, [1, 0, -0.5, 0]), (-1, [0, 1, 0, 0])]
    assert listener.wait(3)[2] == (-1, None)
    with connect(socket_of(site)) as socket:
        socket.send("[0, 0, 0, 1]")
        assert listener.wait(4)[3] == (-2, [0, 0, 0, 1])


@pytest.mark.parametrize("message", ["", "{}", "[1, 2]", "[NaN, 0, 0, 0]", b"\xff"])
def test_invalid_message_ends_the_connection_and_the_motion(site, listener, message):
    with connect(socket_of(site)) as socket:
        socket.send("[1, 0, 0, 0]")
        socket.send(message)
        with pytest.raises(ConnectionClosed):
            socket.recv(timeout=PATIENCE)
    assert listener.wait(2)[-1] == (-1, None)


@pytest.mark.parametrize(
    "text", ["", "[", "null", "[1e999,0,0,0]", '["a",0,0,0]', "[[1],0,0,0]"]
)
def test_texts_that_are_no_axes_are_refused(text):
    assert parse_axes(text) is None


def test_a_page_of_another_site_cannot_drive(site, listener):
    with pytest.raises(Exception, match="403"):
        connect(socket_of(site), origin="http://elsewhere.example").close()
    time.sleep(0.1)
    assert listener.received == []


def test_buttons_that_a_robot_cannot_use_are_disabled():
    page = pad_html(np.array([1.0, 0.0, 1.0, 0.0]))
    disabled = [part[:4] for part in page.split("data-drive='") if " disabled" in part]
    assert disabled == ["KeyR", "KeyA", "KeyD", "KeyF"]


def test_velocity_is_said_in_words():
    assert "0.50 m/s back" in velocity_html(np.array([-0.5, 0.0, 0.0, 0.0]))
    text = velocity_html(np.array([0.0, 0.2, -1.0, 0.05]))
    assert "0.20 m/s left, 1.00 rad/s to the right, 0.05 m/s up" in text
    assert "Hold a key" in velocity_html(np.full(4, 1e-4))
    assert "press it again" in velocity_html(np.zeros(4), waits=True)
