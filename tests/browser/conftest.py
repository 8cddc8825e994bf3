"""A real Chromium, and a GR1 to drive in it."""

import fcntl
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.viewers.loop_timing import SWITCH_INTERVAL
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.teleop_page import TeleopPage
from wbc_suite.viewers.teleop_session import TeleopSession

ARTIFACTS = Path(__file__).resolve().parents[2] / "artifacts"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
SETPRIV = shutil.which("setpriv") if os.geteuid() == 0 else None
GENTLY = (
    "nice -n 4" if SETPRIV is None else f"{SETPRIV} --bounding-set=-sys_nice nice -n 4"
)
"""An administrator's Chromium raises what draws above everything else."""
FLAGS = [
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]
PATIENCE = 300.0  # s; software WebGL draws 2 or 3 pictures a second, shared by all
RATE = 100.0  # Hz, what `wbc-suite teleop` uses
TRIES = 5
DRAWN = """pictures => new Promise(done => {
    const count = () => pictures-- > 0 ? requestAnimationFrame(count) : done()
    count()
})"""
SELDOM = """
    const time = () => performance.now()
    window.requestAnimationFrame = draw => setTimeout(() => draw(time()), 2000)
"""


def wait_until(condition, what, patience=PATIENCE):
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline:
        if value := condition():
            return value
        time.sleep(0.02)
    raise AssertionError(f"waited {patience:g} s in vain: {what}")


def soon(condition):
    deadline = time.monotonic() + PATIENCE / TRIES
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)
    return condition()


class Viewer:
    """One browser page, and the client that it is for the server.

    Args:
        context: Browser context.
        site: PageServer to open.
        size: Of the page, in pixels.
        dots: Drawn per pixel; fewer cost a browser without graphics card less. Below
            one there are no shadows either: two thirds of what a picture costs.
        watching: Whether anybody looks at the robot; else it is drawn seldom.
    """

    def __init__(self, context, site, *, size=(960, 600), dots=0.4, watching=True):
        self.site = site
        self.requests = []
        before = set(site.server.get_clients())
        self.page = context.new_page()
        if not watching:
            self.page.add_init_script(SELDOM)
        self.page.set_viewport_size({"width": size[0], "height": size[1]})
        self.page.on("request", lambda request: self.requests.append(request.url))
        began = time.monotonic()
        self.page.goto(f"{site.url}{'&' if '?' in site.url else '?'}fixedDpr={dots}")
        number = wait_until(
            lambda: set(site.server.get_clients()) - before, "the page connects"
        ).pop()
        self.load_time = time.monotonic() - began
        self.client = site.server.get_clients()[number]
        self.client.scene.configure_default_lights(cast_shadow=dots >= 1.0)
        wait_until(
            lambda: self.client.camera.image_width > 0, "the page tells its camera"
        )

    def pixel(self, point):
        """Where a point in the world is seen, in pixels of the page."""
        camera = self.client.camera
        R = pin.Quaternion(np.roll(camera.wxyz, -1)).toRotationMatrix()
        x, y, z = R.T @ (point - camera.position)
        box = self.page.locator("canvas").first.bounding_box()
        focal = box["height"] / 2 / np.tan(camera.fov / 2)
        return np.array(
            [
                box["x"] + box["width"] / 2 + focal * x / z,
                box["y"] + box["height"] / 2 + focal * y / z,
            ]
        )

    def arrow(self, pose, scale):
        """The arrow of a gizmo that is seen best: its axis, and a pixel to grab."""
        origin = self.pixel(pose.translation)
        tips = [
            self.pixel(pose.translation + 0.9 * scale * axis)
            for axis in pose.rotation.T
        ]
        best = int(np.argmax([np.linalg.norm(tip - origin) for tip in tips]))
        along = tips[best] - origin
        return pose.rotation[:, best], tips[best], along / np.linalg.norm(along)

    def draw(self, pictures=3):
        """Wait until the page has drawn: what it was told is on the screen then."""
        self.page.evaluate(DRAWN, pictures)

    def drag(self, start, direction, pixels, *, release=True, steps=6):
        """Press at a pixel, move, and let go, as a hand on a mouse would."""
        mouse = self.page.mouse
        self.page.bring_to_front()
        mouse.move(*start)
        self.draw()
        mouse.down()
        for k in range(1, steps + 1):
            mouse.move(*(start + direction * pixels * k / steps))
            self.draw(1)
        if release:
            mouse.up()

    def drag_until(self, took, grip, pixels, *, sign=1.0, release=True, steps=6):
        """Drag; again where the arrow was missed, as a person does.

        Args:
            took: Tells whether it was not missed.
            grip: Returns an axis, a pixel, and a direction; see `arrow`.
            pixels: How far.
            sign: 1 along the direction, -1 against it.
            release: Whether the button is let go.
            steps: Moves of the mouse.
        """
        for _ in range(TRIES):
            _, start, along = grip()
            self.drag(start, sign * along, pixels, release=release, steps=steps)
            if soon(took):
                return
            self.page.mouse.up()
        raise AssertionError(f"dragged {TRIES} times in vain")

    def hold_key_until(self, works, key):
        """Hold a key; again where the page had not connected yet, as a person does."""
        for _ in range(TRIES):
            self.page.keyboard.down(key)
            if soon(works):
                return
            self.page.keyboard.up(key)
        raise AssertionError(f"pressed {key} {TRIES} times in vain")

    def screenshot(self, name):
        ARTIFACTS.mkdir(exist_ok=True)
        self.page.screenshot(path=str(ARTIFACTS / f"{name}.png"))


def note(**figures):
    """Keep measured figures beside the screenshots, and print them."""
    ARTIFACTS.mkdir(exist_ok=True)
    file = ARTIFACTS / "teleop.json"
    known = json.loads(file.read_text()) if file.exists() else {}
    file.write_text(json.dumps(known | figures, indent=2) + "\n")
    print(figures)


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """Chromium that draws in software, behind the simulation in the queue.

    A person's browser draws on a graphics card; here it would take the processor that
    the control loop needs.
    """
    api = pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("There is no Chromium: apt-get install chromium")
    with api.sync_playwright() as playwright:
        gentle = tmp_path_factory.mktemp("chromium") / "gentle"
        gentle.write_text(f'#!/bin/sh\nexec {GENTLY} {CHROMIUM} "$@"\n')
        gentle.chmod(0o755)
        browser = playwright.chromium.launch(executable_path=gentle, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def packages():
    """The folder of the npm packages that these tests load."""
    here = Path(__file__).parent
    folder = here / "node_modules"
    with (here / "package-lock.json").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # other workers want them too
        names = json.loads((here / "package.json").read_text())["dependencies"]
        if not all((folder / name).exists() for name in names):
            npm = shutil.which("npm")
            if npm is None:
                pytest.skip("There is no npm: apt-get install npm")
            command = [npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund"]
            subprocess.run(command, cwd=here, check=True, timeout=300)
    return folder


@pytest.fixture
def context(browser):
    context = browser.new_context(viewport={"width": 960, "height": 600})
    context.set_default_timeout(1e3 * PATIENCE)
    yield context
    context.close()


def served(robot, controller="WHOLE_BODY_IK", host="127.0.0.1"):
    env = wbc_suite.make(
        "Lift",
        robots=robot,
        controller_configs=controller,
        control_freq=RATE,
        horizon=10**7,
    )
    session = TeleopSession(env, period=1 / RATE)
    for limb in session.limbs.values():  # a slow browser is not a frozen one
        limb.hold_timeout = PATIENCE
    session._drive.timeout = PATIENCE
    page = TeleopPage(session, PageServer(host, port=0), label=f"{robot} · Lift")
    page.start()
    session.start()
    return session, page


def running(robot):
    interval = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL)  # as the command does
    session, page = served(robot)
    yield session, page
    session.stop()
    page.stop()
    sys.setswitchinterval(interval)


@pytest.fixture(scope="module")
def gr1():
    yield from running("GR1")


@pytest.fixture(scope="module")
def panda():
    """A robot with few shapes, for what does not depend on the robot."""
    yield from running("Panda")
