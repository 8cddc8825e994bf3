"""A robot that walks, driven in a real browser by keys, buttons and the mouse."""

import numpy as np
import pytest
from conftest import Viewer, served, wait_until

pytestmark = [pytest.mark.browser, pytest.mark.slow]

PUSH = [900.0, 900.0, 0.0]  # N, at the pelvis


@pytest.fixture(scope="module")
def walker():
    session, page = served("GR1FreeBody", "WHOLE_BODY_ID")
    yield session, page
    session.stop()
    page.stop()


def place(session):
    return session.snapshot.body_positions[session.model.body("robot0_base_link").id]


def moves(session, axis, sign):
    return sign * session.snapshot.velocity[axis] > 0.02


def stands(session):
    return not session.snapshot.velocity.any()


def test_keys_and_buttons_walk_while_held_and_a_fall_can_be_reset(walker, context):
    session, page = walker
    viewer = Viewer(context, page.site, size=(1100, 800), dots=0.4)
    tab, keyboard = viewer.page, viewer.page.keyboard
    tab.get_by_role("button", name="forward", exact=True).wait_for()
    tab.get_by_label("Balance").click()
    wait_until(lambda: session.snapshot.balance is not None, "the balance is shown")
    camera = viewer.client.camera.position.copy()

    start = place(session)
    viewer.hold_key_until(lambda: moves(session, 0, -1), "s")
    wait_until(lambda: (place(session) - start)[0] < -0.4, "it walks backwards")
    tab.get_by_text("m/s back").wait_for()
    wait_until(lambda: session.snapshot.balance.footstep is not None, "it steps")
    viewer.screenshot("teleop_walking")
    keyboard.up("s")
    wait_until(lambda: stands(session), "a released key stops it")
    # The same keys move the camera of a page that does not drive: here it follows.
    wait_until(
        lambda: (
            np.linalg.norm((viewer.client.camera.look_at - place(session))[:2]) < 0.2
        ),
        "the camera has followed",
    )
    followed = viewer.client.camera.position - camera
    assert followed[0] < -0.3
    assert abs(followed[2]) < 0.01

    keyboard.down("q")
    wait_until(lambda: moves(session, 2, 1), "it turns left")
    tab.evaluate("dispatchEvent(new Event('blur'))")
    wait_until(lambda: stands(session), "a page out of focus stops it")
    keyboard.up("q")

    tab.get_by_role("button", name="down", exact=True).hover()
    tab.mouse.down()
    wait_until(lambda: moves(session, 3, -1), "a held button lowers it")
    tab.mouse.up()
    wait_until(lambda: stands(session), "a released button stops it")

    tab.get_by_role("button", name="World").click()
    wait_until(lambda: not session.snapshot.rides, "hands stay in the world")

    simulation = session.env.unwrapped.simulation
    pelvis = simulation.data.xfrc_applied[session.model.body("robot0_base_link").id]
    pelvis[:3] = PUSH
    wait_until(lambda: session.snapshot.fell, "it falls")
    pelvis[:3] = 0.0
    tab.get_by_text("It fell").wait_for()
    viewer.screenshot("teleop_fallen")
    tab.get_by_role("button", name="Reset after the fall").click()
    wait_until(lambda: not session.snapshot.fell, "it stands again")
    assert place(session)[2] > 0.8


def test_closing_a_page_with_a_key_held_stops_the_robot(walker, context):
    session, page = walker
    session.reset()
    viewer = Viewer(context, page.site, size=(760, 440), dots=0.3)
    viewer.page.get_by_role("button", name="forward", exact=True).wait_for()
    viewer.hold_key_until(lambda: moves(session, 0, -1), "s")
    viewer.page.close()
    wait_until(lambda: stands(session), "it stops")
    assert np.linalg.norm(session.snapshot.velocity) == 0.0
