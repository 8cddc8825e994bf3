"""Teleoperation as a person does it: a real browser, a real mouse, a simulated GR1."""

import time

import numpy as np
import pytest
from conftest import RATE, Viewer, note, served, wait_until

from wbc_suite.viewers.page_process import PageProcess

pytestmark = [pytest.mark.browser, pytest.mark.slow]

HAND, OTHER = "right_hand", "left_hand"
SCALE = 0.22  # m, of a hand's handle
ENDS = {
    "hidden": """
        Object.defineProperty(document, 'hidden', { get: () => true })
        document.dispatchEvent(new Event('visibilitychange'))
    """,
    "pagehide": "dispatchEvent(new Event('pagehide'))",
    "pointercancel": "document.querySelector('canvas').dispatchEvent("
    "new PointerEvent('pointercancel', {pointerId: 1, bubbles: true}))",
    "missed": "document.querySelector('canvas').dispatchEvent("
    "new PointerEvent('pointermove', {pointerId: 1, buttons: 0, bubbles: true}))",
}
"""How a drag ends without a release that the page sees."""


@pytest.fixture
def settled(panda):
    session, page = panda
    session.enable(HAND, True)  # a test that failed may have left it
    session.reset()
    epoch = session.snapshot.epoch
    wait_until(lambda: session.snapshot.epoch > epoch, "the reset")
    wait_until(
        lambda: session.snapshot.limbs[HAND].position_error < 0.01, "the hand settles"
    )
    return session, page


def target(session, name=HAND):
    return session.snapshot.limbs[name].target


def hand(session, name=HAND):
    return session.snapshot.limbs[name].measured.translation


def moved(session, before, name=HAND):
    return float(np.linalg.norm(target(session, name).translation - before))


def wait_until_still(session):
    """Wait for the last late message of a drag, and for a target out of reach."""

    def is_still():
        before = target(session).translation.copy()
        time.sleep(0.5)
        settled = session.limbs[HAND].rest is None
        return settled and moved(session, before) == 0.0

    wait_until(is_still, "the target stands still")


def drag_until(viewer, session, sign=1.0, *, pixels=70, least=0.03, steps=6):
    """Drag the hand's best arrow until its target has moved by `least` along it, m."""
    pose = target(session)
    axis, _, _ = viewer.arrow(pose, SCALE)
    viewer.drag_until(
        lambda: abs((target(session).translation - pose.translation) @ axis) > least,
        lambda: viewer.arrow(target(session), SCALE),
        pixels,
        sign=sign,
        steps=steps,
    )
    wait_until(lambda: session.snapshot.limbs[HAND].holder is None, "the mouse lets go")
    return pose.translation, axis


def hold_and_drag(viewer, session, pixels, *, steps=6):
    """Drag the hand's best arrow, and hold it."""
    number = viewer.client.client_id
    viewer.drag_until(
        lambda: session.snapshot.limbs[HAND].holder == number,
        lambda: viewer.arrow(target(session), SCALE),
        pixels,
        release=False,
        steps=steps,
    )


def timed_drag(viewer, session, sign=1.0):
    """Drag; return how the target moved, and latencies in ms over two periods' time.

    The periods are those that the loop reached meanwhile: 10 ms where it keeps up.
    """
    tick, began = session.snapshot.tick, time.monotonic()
    count = len(session.latencies())
    moved = drag_until(viewer, session, sign, steps=16)
    spent = 1e3 * (time.monotonic() - began)
    period = max(1e3 / RATE, spent / max(session.snapshot.tick - tick, 1))
    return moved, 1e3 * session.latencies()[count:], 2.0 * period


def quietest_latencies(viewer, session, first):
    """Return those of the first drag of three that is in time, or of the last.

    Other tests may take the processors for a while.
    """
    latencies, most = first
    for sign in (-1.0, 1.0):
        if np.median(latencies) < most:
            break
        _, latencies, most = timed_drag(viewer, session, sign)
    return latencies, most


def test_humanoids_hand_follows_the_mouse_in_time(gr1, context):
    session, page = gr1
    viewer = Viewer(context, page.site, size=(1280, 800), dots=0.7)
    viewer.page.get_by_text("input to joint target").wait_for()
    own = (page.site.url, f"blob:{page.site.url}", "data:")
    assert [url for url in viewer.requests if not url.startswith(own)] == []
    start = hand(session).copy()
    (before, axis), *first = timed_drag(viewer, session)
    wait_until(
        lambda: session.snapshot.limbs[HAND].position_error < 0.01,
        "the hand reaches its handle",
    )
    followed = float((hand(session) - start) @ axis)
    asked = float((target(session).translation - before) @ axis)
    latencies, most = quietest_latencies(viewer, session, first)
    viewer.screenshot("teleop_gr1")
    note(
        page_load_s=round(viewer.load_time, 2),
        requests=len(viewer.requests),
        handle_moved_m=round(asked, 4),
        hand_followed_m=round(followed, 4),
        latency_ms_median=round(float(np.median(latencies)), 2),
        latency_ms_p95=round(float(np.quantile(latencies, 0.95)), 2),
        inputs=len(latencies),
        update_cpu_ms_median=round(1e3 * float(np.median(page.site.update_times)), 2),
    )
    assert asked > 0.03
    assert followed == pytest.approx(asked, abs=0.015)
    # 20 ms where the loop keeps up; on a machine that cannot, as it does in CI beside
    # other browsers, two of the periods that it does reach.
    assert np.median(latencies) < most


@pytest.mark.sweep
def test_clutch_comes_in_again_without_a_jump(settled, context):
    session, page = settled
    viewer = Viewer(context, page.site)
    drag_until(viewer, session)
    wait_until_still(session)
    viewer.page.get_by_text("Clutches", exact=True).click()
    box = viewer.page.get_by_label("Right hand").last
    box.click()
    wait_until(lambda: not session.snapshot.limbs[HAND].enabled, "the clutch is out")
    wait_until_still(session)
    held = target(session).translation.copy()
    handle = page.handles.handle(viewer.client.client_id, HAND)
    place = handle.position.copy()
    viewer.drag_until(
        lambda: np.linalg.norm(handle.position - place) > 0.03,
        lambda: viewer.arrow(target(session), SCALE),
        60,
        sign=-1.0,
    )
    wait_until(lambda: session.snapshot.limbs[HAND].holder is None, "the mouse lets go")
    assert moved(session, held) < 1e-9
    box.click()
    wait_until(lambda: session.limbs[HAND].enabled, "the clutch is in")
    time.sleep(0.2)
    assert moved(session, held) < 1e-3


def test_unreachable_target_is_explained_in_words(settled, context):
    session, page = settled
    viewer = Viewer(context, page.site)
    hold_and_drag(viewer, session, 420, steps=8)
    viewer.page.get_by_text("cm short").first.wait_for()
    viewer.screenshot("teleop_unreachable")
    viewer.page.mouse.up()
    words = " ".join(map(str, session.snapshot.limbs[HAND].reasons))
    assert any(word in words for word in ("limit", "conflict", "reach", "obstacle"))


@pytest.mark.sweep
def test_four_clients_do_not_fight(settled, context):
    session, page = settled
    first, second, _, fourth = (
        Viewer(context, page.site, size=(760, 440), watching=who < 2)
        for who in range(4)
    )
    pose = target(session)
    _, other_grip, other_along = second.arrow(pose, SCALE)
    hold_and_drag(first, session, 60)
    wait_until(lambda: moved(session, pose.translation) > 0.02, "the hand is moved")
    wait_until_still(session)
    held = target(session).translation.copy()
    theirs = page.handles.handle(second.client.client_id, HAND)
    wait_until(lambda: not theirs.visible, "the others' handles are put away")
    second.drag(other_grip, -other_along, 80)
    assert moved(session, held) < 1e-9
    text = f"held by viewer {first.client.client_id + 1}"
    fourth.page.get_by_text(text).wait_for()
    first.page.bring_to_front()
    first.page.mouse.up()
    wait_until(lambda: session.snapshot.limbs[HAND].holder is None, "it is let go")
    note(speed_with_four_clients=round(session.snapshot.speed, 3))
    tick = session.snapshot.tick
    wait_until(lambda: session.snapshot.tick > tick + 20, "the control goes on")


def test_closing_a_tab_gives_back_what_it_held(settled, context):
    session, page = settled
    viewer = Viewer(context, page.site)
    hold_and_drag(viewer, session, 40)
    viewer.page.close()
    wait_until(lambda: session.snapshot.limbs[HAND].holder is None, "it is given back")


@pytest.mark.sample(1)
@pytest.mark.parametrize("end", ENDS)
def test_drag_whose_release_is_not_seen_ends(settled, context, monkeypatch, end):
    session, page = settled
    monkeypatch.setattr(session.limbs[HAND], "hold_timeout", np.inf)
    viewer = Viewer(context, page.site)
    hold_and_drag(viewer, session, 40)
    viewer.page.evaluate(ENDS[end])
    wait_until(lambda: session.snapshot.limbs[HAND].holder is None, "it is released")
    wait_until_still(session)
    held = target(session).translation.copy()
    viewer.page.mouse.move(300, 300)
    viewer.draw()
    assert moved(session, held) < 1e-9
    viewer.page.mouse.up()


def test_buttons_pause_and_reset(settled, context):
    session, page = settled
    viewer = Viewer(context, page.site)
    viewer.page.get_by_role("button", name="Pause").click()
    wait_until(lambda: session.snapshot.paused, "the pause")
    number = viewer.client.client_id + 1
    other = Viewer(context, page.site, watching=False)
    other.page.get_by_role("button", name="Resume").click()
    other.page.get_by_text("Only who paused may resume").wait_for()
    other.page.get_by_text(f"Paused: viewer {number} may resume").first.wait_for()
    assert session.snapshot.paused
    other.page.close()
    viewer.page.bring_to_front()
    viewer.page.get_by_role("button", name="Resume").click()
    wait_until(lambda: not session.snapshot.paused, "it goes on")
    epoch = session.snapshot.epoch
    viewer.page.get_by_role("button", name="Reset").click()
    wait_until(lambda: session.snapshot.epoch == epoch + 1, "the reset")
    viewer.page.get_by_role("button", name="Record").click()
    viewer.page.get_by_text("has no file to record").wait_for()


def test_pause_whose_owner_has_left_is_ended_by_anybody(settled, context):
    session, page = settled
    first = Viewer(context, page.site, watching=False)
    first.page.get_by_role("button", name="Pause").click()
    wait_until(lambda: session.snapshot.paused, "the pause")
    first.page.close()
    second = Viewer(context, page.site)
    second.page.get_by_text("Paused: anybody may resume").wait_for()
    assert session.snapshot.paused
    second.page.get_by_role("button", name="Resume").click()
    wait_until(lambda: not session.snapshot.paused, "it goes on")


@pytest.mark.sweep
def test_shadows_are_for_whom_they_are_cheap(settled, context, monkeypatch):
    viewer = Viewer(context, settled[1].site, size=(960, 900))
    asked = []
    monkeypatch.setattr(
        viewer.client.scene,
        "configure_default_lights",
        lambda **wish: asked.append(wish),
    )
    viewer.page.get_by_text("Show", exact=True).click()
    viewer.page.get_by_label("Shadows").click()
    wait_until(lambda: asked == [{"cast_shadow": False}], "the shadows go")


@pytest.mark.sample(1)
@pytest.mark.parametrize("robot", ["Tiago", "SpotWithArm"])
def test_hand_of_every_robot_follows_the_mouse(robot, context):
    session, page = served(robot)
    try:
        viewer = Viewer(context, page.site, dots=0.7)
        drag_until(viewer, session)
        start_error = session.snapshot.limbs[HAND].position_error
        wait_until(
            lambda: session.snapshot.limbs[HAND].position_error < 0.02,
            f"the hand reaches its handle ({start_error:.3f} m away)",
        )
        viewer.screenshot(f"teleop_{robot.lower()}")
    finally:
        session.stop()
        page.stop()


def test_page_for_others_asks_for_its_token(context):
    session, page = served("Panda", host="0.0.0.0")
    try:
        browser_page = context.new_page()
        answer = browser_page.goto(page.site.url.split("?")[0])
        assert answer is not None
        assert answer.status == 401
        assert "token" in browser_page.content()
        assert not page.site.server.get_clients()
        viewer = Viewer(context, page.site)
        assert "token" not in viewer.page.url
    finally:
        session.stop()
        page.stop()


def test_page_of_another_process_shows_and_pauses_the_session(settled, context):
    session, _ = settled
    page = PageProcess("127.0.0.1", 0, label="Panda · Lift")
    try:
        page.attach(session)
        tab = context.new_page()
        tab.goto(page.url)
        tab.get_by_text("input to joint target").wait_for()
        for button, paused in (("Pause", True), ("Resume", False)):
            tab.get_by_role("button", name=button).click()
            wait_until(lambda now=paused: session.snapshot.paused is now, button)
    finally:
        owner = session.snapshot.paused_by
        session.pause(0 if owner is None else owner, False)
        page.stop()
