"""Draw the teleoperation page: GR1 lifts the cube with its right hand, and walks.

Needs Chromium and playwright. `film` gives what the browser shows on the way.
"""

import io
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pinocchio as pin
from PIL import Image
from playwright.sync_api import Page, sync_playwright

import wbc_suite
from wbc_suite.devices.action_ports import limb_ports
from wbc_suite.envs import RobotEnv
from wbc_suite.evaluation import make_policy
from wbc_suite.typing import Vector
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.teleop_page import TeleopPage
from wbc_suite.viewers.teleop_session import TeleopSession

IMAGES = Path(__file__).parent / "images"
HAND = "right_hand"
SEED = 0
RATE = 50.0  # Hz; 100 is too many beside a browser that draws by software
SIZE = (1280, 800)  # pixels
PACE = 0.1  # s, between two drags
WALKED = 3.0  # s
LOADING = 25.0  # s; the environment's light comes last
FLAGS = [
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
]


def drags() -> list[tuple[pin.SE3, Vector]]:
    """Return poses of the hand in the world and positions of its gripper.

    They are those of the expert, which lifts the cube of the same scene.
    """
    env = wbc_suite.make(
        "Lift", robots="GR1", controller_configs="WHOLE_BODY_IK", horizon=10**7
    )
    assert isinstance(env, RobotEnv)
    observation, _ = env.reset(seed=SEED)
    policy, info = make_policy("expert", env, SEED), dict[str, Any]()
    port, layout = limb_ports(env)[HAND], env.action_layout
    found = []
    while not info.get("success"):
        action = policy(observation)
        pose = port.decode(action[layout[HAND].start : layout[HAND].stop])
        gripper = layout["right_gripper"]
        found.append((pose, action[gripper.start : gripper.stop]))
        observation, *_, info = env.step(action)
    env.close()
    return found


@contextmanager
def page_of(robot: str) -> Iterator[tuple[TeleopSession, Page]]:
    """Teleoperate a robot, and open its page in a browser."""
    env = wbc_suite.make("Lift", robots=robot, control_freq=RATE, horizon=10**7)
    session = TeleopSession(env, period=1.0 / RATE, seed=SEED)
    for limb in session.limbs.values():  # a browser that draws slowly is not gone
        limb.hold_timeout = 300.0
    session.start()
    page = TeleopPage(session, PageServer(port=0), label=f"{robot} · Lift")
    page.start()
    with sync_playwright() as playwright:
        chromium = shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        width, height = SIZE
        tab = browser.new_page(viewport={"width": width, "height": height})
        tab.set_default_timeout(120_000)
        tab.goto(page.site.url)
        time.sleep(LOADING)
        notice = tab.get_by_text("Software WebGL").locator("xpath=../..")
        notice.locator("button").first.dispatch_event("click")
        time.sleep(8.0)
        yield session, tab
        browser.close()
    page.stop()
    session.stop()
    env.close()


def film(every: int = 1) -> Iterator[Image.Image]:
    """Yield what the page shows after each drag, or every so many of them."""
    with page_of("GR1") as (session, tab):
        session.grab(HAND, 0, session.snapshot.limbs[HAND].target)
        for k, (pose, gripper) in enumerate(drags()):
            session.drag(HAND, 0, pose)
            for index, value in enumerate(gripper):
                session.set_gripper("right_gripper", index, float(value))
            time.sleep(PACE)
            if k % every == 0:
                yield _screenshot(tab)
        session.release(HAND, 0)
        time.sleep(3.0)  # figures of the last seconds are shown
        yield _screenshot(tab)


def walking() -> Image.Image:
    """Return what the page shows while a key is held that walks backwards."""
    with page_of("GR1FreeBody") as (_, tab):
        tab.get_by_label("Balance").click()
        tab.mouse.move(300, 300)  # off the words that explain it
        tab.get_by_text("Lift a cube").scroll_into_view_if_needed()
        tab.keyboard.down("s")
        time.sleep(WALKED)
        picture = _screenshot(tab)
        tab.keyboard.up("s")
    return picture


def _screenshot(tab: Page) -> Image.Image:
    return Image.open(io.BytesIO(tab.screenshot())).convert("RGB")


def main() -> None:
    """Draw the page once the cube is lifted, and while the robot walks."""
    *_, lifted = film(every=1000)
    for name, picture in (("teleop", lifted), ("teleop_walking", walking())):
        picture.save(IMAGES / f"{name}.jpg", quality=82, optimize=True)


if __name__ == "__main__":
    main()
