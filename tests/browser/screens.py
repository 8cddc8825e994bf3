"""The teleoperation page on three screens, as somebody finds it who only reads it.

Not part of the suite until it has passed often: `pytest tests/browser/screens.py`.
"""

import contextlib
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import RATE, Viewer, note, wait_until

import wbc_suite
from wbc_suite.recording.episode_control import EpisodeControl
from wbc_suite.viewers.loop_timing import SWITCH_INTERVAL
from wbc_suite.viewers.page_process import PageProcess
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.teleop_page import TeleopPage
from wbc_suite.viewers.teleop_session import TeleopSession
from wbc_suite.wrappers import DataCollection

pytestmark = [pytest.mark.browser, pytest.mark.slow]

SCREENS = {"monitor": (1600, 900), "laptop": (1280, 720), "phone": (390, 844)}
SCALE = 0.22  # m, of a hand's handle
DOTS = 0.3  # drawn per pixel
SERIOUS = ("serious", "critical")
LOOK = 0.5  # s, of a person between two gestures
PACE = 200.0  # pixels per second, of a person's mouse


@contextlib.contextmanager
def serve(benchmark, robots, path=None):
    interval = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL)  # as the command does
    env = wbc_suite.make(
        benchmark,
        robots=robots,
        controller_configs="WHOLE_BODY_IK",
        control_freq=RATE,
        horizon=10**7,
    )
    control = None
    if path is not None:
        env = DataCollection(env, path, automatic=False)
        control = EpisodeControl(env.recorder, seed=0)
    session = TeleopSession(env, period=1 / RATE, episode_control=control)
    for limb in session.limbs.values():  # a slow browser is not a frozen one
        limb.hold_timeout = 300.0
    page = TeleopPage(session, PageServer(port=0), label=f"{robots} · {benchmark}")
    page.start()
    session.start()
    yield session, page
    session.stop()
    page.stop()
    env.close()
    sys.setswitchinterval(interval)


@pytest.fixture(scope="module")
def lift(tmp_path_factory):
    path = tmp_path_factory.mktemp("screens") / "made.hdf5"
    with serve("Lift", "Panda", path) as served:
        yield served


@pytest.fixture(scope="module")
def pot():
    with serve("TwoArmLift", ["Panda", "Panda"]) as served:
        yield served


@pytest.fixture(params=SCREENS)
def screen(request, browser):
    """A context of a screen's size; that of a phone has touch."""
    width, height = SCREENS[request.param]
    context = browser.new_context(
        viewport={"width": width, "height": height}, has_touch=request.param == "phone"
    )
    context.set_default_timeout(300e3)
    yield context, request.param
    context.close()


class Person:
    """Somebody with a mouse or a finger, who moves as fast as people do.

    Attributes:
        spent: Time that the gestures take a person, s.
    """

    def __init__(self, context, site, screen):
        self.viewer = Viewer(context, site, size=SCREENS[screen], dots=DOTS)
        self.page, self.spent = self.viewer.page, 0.0
        self.finger = None
        if screen == "phone":
            self.finger = context.new_cdp_session(self.page)

    def drag(self, start, end, steps=6):
        """Press at a pixel, move to another one, and let go."""
        self.spent += LOOK + float(np.linalg.norm(end - start)) / PACE
        path = [start + (end - start) * k / steps for k in range(1, steps + 1)]
        if self.finger is None:
            self.viewer.drag(start, (end - start), 1.0, steps=steps)
            return
        self._touch("touchStart", start)
        for point in path:
            self._touch("touchMove", point)
            self.viewer.draw(1)
        self._touch("touchEnd")

    def _touch(self, kind, point=None):
        points = [] if point is None else [{"x": point[0], "y": point[1]}]
        event = {"type": kind, "touchPoints": points}
        self.finger.send("Input.dispatchTouchEvent", event)

    def move(self, session, limb, step):
        """Drag the arrow that points most along a step in the world, m, shape (3,)."""
        target = session.snapshot.limbs[limb].target
        along = target.rotation.T @ step
        axis = target.rotation[:, (best := int(np.argmax(np.abs(along))))]
        tip = target.translation + 0.9 * SCALE * axis
        start, end = (self.viewer.pixel(p) for p in (tip, tip + along[best] * axis))
        self.drag(start, end)
        wait_until(lambda: session.snapshot.limbs[limb].holder is None, "it lets go")
        before = target.translation
        return float((session.snapshot.limbs[limb].target.translation - before) @ axis)

    def click(self, button):
        self.spent += 2 * LOOK
        self.page.get_by_role("button", name=button, exact=True).click()


def faults(page, packages):
    """What axe finds serious on a page, with its first elements."""
    page.evaluate((packages / "axe-core" / "axe.min.js").read_text() + ";0")
    return {
        fault["id"]: [node["html"][:200] for node in fault["nodes"][:3]]
        for fault in page.evaluate("axe.run()")["violations"]
        if fault["impact"] in SERIOUS
    }


def inside(box, point):
    x, y = point[0] - box["x"], point[1] - box["y"]
    return 0 <= x <= box["width"] and 0 <= y <= box["height"]


def test_scene_and_panel_are_both_seen_whole(lift, screen):
    (session, page), (context, name) = lift, screen
    viewer = Viewer(context, page.site, size=SCREENS[name], dots=DOTS)
    tab, (width, height) = viewer.page, SCREENS[name]
    assert tab.title() == "Panda · Lift"
    tab.get_by_role("heading", name="Lift a cube").wait_for()
    viewer.draw()
    scene = tab.locator("canvas").first.bounding_box()
    task = tab.get_by_role("heading", name="Lift a cube").bounding_box()
    beside = task["x"] >= scene["x"] + scene["width"]
    below = task["y"] >= scene["y"] + scene["height"]
    assert (below, beside) == ((True, False) if name == "phone" else (False, True))
    assert scene["width"] * scene["height"] > 0.4 * width * height
    for body in ("robot0_panda_hand", "cube"):
        place = session.snapshot.body_positions[session.model.body(body).id]
        assert inside(scene, viewer.pixel(place)), body
    for button in tab.get_by_role("button").all():
        if box := button.bounding_box():
            assert box["x"] >= 0, button
            assert box["x"] + box["width"] <= width, button
    viewer.screenshot(f"screen_{name}")


def test_axe_finds_no_serious_fault(lift, screen, packages):
    (_, page), (context, name) = lift, screen
    size = SCREENS[name]
    tab = Viewer(context, page.site, size=size, dots=DOTS, watching=False).page
    for folder in ("Show", "Clutches"):
        tab.get_by_role("button", name=folder, exact=True).dispatch_event("click")
    tab.get_by_role("slider", name="Right gripper").wait_for()
    assert faults(tab, packages) == {}
    tab.get_by_label("Dark colours").dispatch_event("click")
    tab.wait_for_selector("html[data-mantine-color-scheme=dark]")
    assert faults(tab, packages) == {}
    tab.keyboard.press("?")
    tab.get_by_text("change between arrows and arcs").wait_for()
    assert faults(tab, packages) == {}


def test_a_hand_is_dragged_and_recorded(lift, screen):
    (session, page), (context, name) = lift, screen
    person = Person(context, page.site, name)
    person.click("Record")
    person.page.get_by_text("Recording episode").wait_for()
    moved = 0.0
    for _ in range(5):  # an arrow may be missed
        if (
            abs(moved := person.move(session, "right_hand", np.array([0, 0, 0.06])))
            > 0.02
        ):
            break
    assert moved == pytest.approx(-0.06, abs=0.03)  # its axis points down
    person.click("Discard")
    person.page.get_by_text("Recording episode").wait_for(state="hidden")
    epoch = session.snapshot.epoch
    person.click("Reset")
    wait_until(lambda: session.snapshot.epoch > epoch, "the reset")


def test_two_robots_have_two_named_hands(pot, screen):
    (session, page), (context, name) = pot, screen
    person = Person(context, page.site, name)
    for number in (0, 1):
        title = f"Robot {number} right hand"
        person.page.get_by_text(title).first.wait_for()
        limb = f"robot{number}_right_hand"
        for _ in range(5):
            if abs(person.move(session, limb, np.array([0, 0, 0.06]))) > 0.02:
                break
        assert session.snapshot.limbs[limb].moved
    person.viewer.screenshot(f"two_robots_{name}")
    session.reset()


def test_who_only_reads_the_page_lifts_the_cube(lift, browser):
    """Over the cube, down, close, up, by arrows and the slider that the page names."""
    session, page = lift
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    context.set_default_timeout(300e3)
    person = Person(context, page.site, "laptop")
    epoch = session.snapshot.epoch
    person.click("Reset")
    wait_until(lambda: session.snapshot.epoch > epoch, "the reset")
    person.page.get_by_text("Drag an arrow of a handle").wait_for()
    cube = session.model.body("cube").id

    def away(up):
        target = session.snapshot.limbs["right_hand"].target.translation
        return session.snapshot.body_positions[cube] + [0, 0, up] - target

    for up, near in ((0.08, 0.02), (0.0, 0.01)):
        while np.linalg.norm(step := away(up)) > near:
            person.move(session, "right_hand", step)
            assert person.spent < 60.0
    slider = person.page.get_by_role("slider", name="Right gripper")
    track = slider.locator("xpath=..").bounding_box()
    person.page.mouse.click(
        track["x"] + track["width"] - 1, track["y"] + track["height"] / 2
    )
    person.spent += 2 * LOOK
    wait_until(lambda: session.snapshot.grippers["right_gripper"][0] > 0.9, "it closes")
    begun = session.snapshot.time
    wait_until(lambda: session.snapshot.time > begun + 1.0, "fingers close")
    while not session.snapshot.success:
        person.move(session, "right_hand", np.array([0, 0, 0.1]))
        assert person.spent < 60.0
    person.page.get_by_text("Solved in").wait_for()
    person.page.get_by_text("1 solved").wait_for()
    person.viewer.screenshot("reads_and_lifts")
    note(
        lift_by_reading_s=round(person.spent, 1),
        lift_by_reading_simulated_s=round(session.snapshot.solved_at, 1),
    )
    context.close()


def test_a_camera_is_shown_on_the_page(lift, browser):
    _, page = lift
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    context.set_default_timeout(300e3)
    tab = Viewer(context, page.site, dots=DOTS).page
    tab.get_by_role("combobox", name="Camera").click()
    tab.get_by_role("option", name="agentview").click()
    picture = tab.locator("img[alt='Camera picture'][src^='blob:']")
    picture.wait_for()
    mean = """image => {
        const canvas = new OffscreenCanvas(320, 240), draw = canvas.getContext("2d")
        draw.drawImage(image, 0, 0)
        const {data} = draw.getImageData(0, 0, 320, 240)
        return data.reduce((sum, x) => sum + x, 0) / data.length
    }"""
    black = 255 / 4  # the mean of black pixels, which are opaque
    wait_until(lambda: picture.evaluate(mean) > black + 20, "a picture comes")
    tab.get_by_role("combobox", name="Camera").click()
    tab.get_by_role("option", name="none").click()
    picture.wait_for(state="hidden")
    context.close()


def test_the_pages_process_stays_small(lift, browser):
    session, _ = lift
    page = PageProcess("127.0.0.1", 0, label="Panda · Lift")
    try:
        page.attach(session)
        context = browser.new_context()
        context.set_default_timeout(300e3)
        tab = context.new_page()
        tab.goto(page.url)
        tab.get_by_role("combobox", name="Camera").click()
        tab.get_by_role("option", name="agentview").click()
        tab.locator("img[alt='Camera picture'][src^='blob:']").wait_for()
        status = Path(f"/proc/{page.pid}/status").read_text()
        (line,) = [row for row in status.splitlines() if row.startswith("VmHWM")]
        used = int(line.split()[1]) / 1024  # MB
        note(page_process_mb=round(used))
        assert used < 1000
        context.close()
    finally:
        page.stop()
