"""What drives from the page: keys and a gamepad, and a connection that drops."""

import threading

import numpy as np
import pytest
from conftest import wait_until

from wbc_suite.viewers.drive_panel import pad_html
from wbc_suite.viewers.page_server import PageServer

pytestmark = pytest.mark.browser

SOCKETS = """
    window.sockets = []
    window.WebSocket = class extends WebSocket {
        constructor(...options) { super(...options); sockets.push(this) }
    }
"""
DROP = "sockets.findLast(s => s.url.endsWith('/held_keys')).close()"
PAD = """
    window.pad = { mapping: "standard", axes: [0, 0, 0, 0],
                   buttons: [...Array(17)].map(() => ({ pressed: false, value: 0 })) }
    navigator.getGamepads = () => [window.pad]
"""
ENABLE = "pad.buttons[4] = {{ pressed: {0}, value: Number({0}) }}"


class Listener:
    """Keeps what each client said last, and the number of the newest."""

    def __init__(self):
        self.said, self.lock = {}, threading.Lock()

    def __call__(self, client, axes):
        with self.lock:
            self.said[client] = None if axes is None else axes.tolist()

    @property
    def newest(self):
        with self.lock:
            return min(self.said, default=0)

    @property
    def axes(self):
        """What the newest client said last."""
        with self.lock:
            return self.said[min(self.said)] if self.said else None


@pytest.fixture
def listener():
    return Listener()


@pytest.fixture
def page(context, listener):
    site = PageServer(port=0)
    page = context.new_page()
    page.add_init_script(SOCKETS)
    page.add_init_script(PAD)
    page.goto(site.url)  # before there is a session, as in `wbc-suite teleop`
    page.wait_for_selector("canvas")
    page.keyboard.press("w")
    assert not page.evaluate("sockets.some(s => s.url.endsWith('/held_keys'))")
    site.server.gui.add_html(pad_html(np.ones(4)))
    site.keys.listen(listener)
    wait_until(lambda: listener.axes == [0, 0, 0, 0], "the page connects, with zeros")
    yield page
    page.close()
    site.stop()


def drop(page, listener):
    """Drop the connection, and wait for the next one."""
    before = listener.newest
    page.evaluate(DROP)
    wait_until(lambda: listener.newest < before, "the page connects again")


def test_key_that_is_held_while_the_connection_drops_drives_when_pressed_anew(
    page, listener
):
    page.keyboard.down("w")
    wait_until(lambda: listener.axes == [1, 0, 0, 0], "it drives")
    drop(page, listener)
    page.wait_for_timeout(500)
    assert listener.axes == [0, 0, 0, 0]
    page.keyboard.down("w")  # the keyboard repeats it
    page.wait_for_timeout(300)
    assert listener.axes == [0, 0, 0, 0]
    page.keyboard.up("w")
    page.keyboard.down("w")
    wait_until(lambda: listener.axes == [1, 0, 0, 0], "it drives again")


def test_gamepad_drives_while_its_enable_button_is_held(page, listener):
    page.evaluate("pad.axes[1] = -1")
    page.wait_for_timeout(400)
    assert listener.axes == [0, 0, 0, 0]
    page.evaluate(ENABLE.format("true"))
    wait_until(lambda: listener.axes == [1, 0, 0, 0], "it drives")
    drop(page, listener)
    page.wait_for_timeout(500)
    assert listener.axes == [0, 0, 0, 0]
    page.evaluate(ENABLE.format("false"))
    page.wait_for_timeout(400)
    page.evaluate(ENABLE.format("true"))
    wait_until(lambda: listener.axes == [1, 0, 0, 0], "it drives again")
    page.evaluate(ENABLE.format("false"))
    wait_until(lambda: listener.axes == [0, 0, 0, 0], "it stops")
