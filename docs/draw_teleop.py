"""Draw the picture of the teleoperation page: needs Chromium and playwright."""

import io
import shutil
import time
from pathlib import Path

import numpy as np
import pinocchio as pin
from PIL import Image
from playwright.sync_api import sync_playwright

import wbc_suite
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.teleop_page import TeleopPage
from wbc_suite.viewers.teleop_session import TeleopSession

FILE = Path(__file__).parent / "images" / "teleop.jpg"
RATE = 100.0  # Hz
FLAGS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"]
MOVES = {"right_hand": (0.06, -0.06, 0.14), "left_hand": (0.0, 0.06, 0.05)}
PULL = np.array([0.10, -0.40, 0.02])  # m, of the right hand: the torso gives way


def main() -> None:
    """Move both of GR1's hands far, and keep what the browser shows."""
    env = wbc_suite.make("Lift", robots="GR1", control_freq=RATE, horizon=10**7)
    session = TeleopSession(env, period=1.0 / RATE)
    page = TeleopPage(session, PageServer(port=0), label="GR1 · Lift")
    page.start()
    session.start()
    for name, offset in MOVES.items():
        _pull(session, name, np.array(offset))
    _pull(session, "right_hand", PULL)
    with sync_playwright() as playwright:
        chromium = shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        tab = browser.new_page(viewport={"width": 1280, "height": 800})
        tab.set_default_timeout(120_000)
        tab.goto(page.site.url)
        time.sleep(25.0)  # the environment's light comes last
        notice = tab.get_by_text("Software WebGL").locator("xpath=../..")
        notice.locator("button").first.dispatch_event("click")
        time.sleep(8.0)
        picture = Image.open(io.BytesIO(tab.screenshot()))
        browser.close()
    session.stop()
    page.stop()
    picture.convert("RGB").save(FILE, quality=82, optimize=True)


def _pull(session: TeleopSession, name: str, offset: np.ndarray) -> None:
    """Drag a hand for two seconds, as fast as a browser sends."""
    target = session.snapshot.limbs[name].target
    session.grab(name, 0, target)
    for part in np.linspace(0.0, 1.0, 40):
        place = target.translation + part * offset
        session.drag(name, 0, pin.SE3(target.rotation, place))
        time.sleep(0.05)


if __name__ == "__main__":
    main()
