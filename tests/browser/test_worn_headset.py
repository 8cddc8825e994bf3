"""An emulated headset in a real Chromium, worn by somebody who moves as people do."""

import json
import sys
import time
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pinocchio as pin
import pytest
from conftest import ARTIFACTS, RATE, note, wait_until
from operator_of_hand import APPROACH, RISE, HandOperator

import wbc_suite
from wbc_suite.devices import PipelineConfig
from wbc_suite.devices.headset import Headset
from wbc_suite.viewers.headset_view import SessionView
from wbc_suite.viewers.loop_timing import SWITCH_INTERVAL
from wbc_suite.viewers.teleop_session import TeleopSession

sys.path.append(str(Path(__file__).parents[1] / "devices"))
from human_hand import NAMES, TO_FRAME, around, sign

pytestmark = [pytest.mark.browser, pytest.mark.slow]

OPEN, CLOSED = 0.09, 0.02  # m, between the user's thumb and fingers
INTO = np.array([0.0, 0.0, 0.005])  # m, where the cube is held, above its centre
STEADY = PipelineConfig(hold_after=3.0)  # software draws a picture in up to a second
EMULATION = """
    const hands = %s
    window.device = new IWER.XRDevice(IWER.metaQuest3)
    const own = Object.getOwnPropertySymbols(device.hands.right)
        .find(symbol => symbol.description === "@iwer/xr-hand-input")
    const { poses } = device.hands.right[own]
    for (const [name, joints] of Object.entries(hands)) {
        const jointTransforms = {}
        joints.forEach(([joint, offsetMatrix]) => {
            jointTransforms[joint] = {offsetMatrix, radius: 0.008}
        })
        const { gripOffsetMatrix } = poses.default
        poses[name] = {jointTransforms, gripOffsetMatrix}
    }
    device.installRuntime({forceInstall: true})
    device.stereoEnabled = false
    window.lost = false  // the emulator calls every position estimated
    const get = () => window.lost
    Object.defineProperty(XRPose.prototype, "emulatedPosition", { get })
    window.pulses = 0
"""
COUNT_PULSES = """() => {
    const motors = [...(headset.session?.inputSources || [])].flatMap(
        ({gamepad}) => [...(gamepad?.hapticActuators || [])])
    for (const motor of motors) motor.pulse = async () => { window.pulses += 1 }
    return motors.length > 0
}"""


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    interval = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL)  # as the command does
    env = wbc_suite.make(
        "Lift",
        robots="GR1",
        controller_configs="WHOLE_BODY_IK",
        control_freq=RATE,
        horizon=10**7,
    )
    device = Headset(port=0)
    device.start()
    session = TeleopSession(env, period=1 / RATE, device=device, pipeline=STEADY)
    session.tick()
    device.show(SessionView(session, "GR1 · Lift"))
    session.start()
    yield session, device
    session.stop()
    device.stop()
    sys.setswitchinterval(interval)


class Wearer:
    """Somebody with the headset on; what it tracks is set here."""

    def __init__(self, context, device, packages, *, bare=False):
        self.page, self.requests, self.faults = context.new_page(), [], []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.set_viewport_size({"width": 480, "height": 320})
        poses = {"default": around(OPEN), "pinch": around(CLOSED), "sign": sign()}
        hands = {
            name: list(zip(NAMES, joints.transpose(0, 2, 1).reshape(25, 16).tolist(),
                           strict=True))
            for name, joints in poses.items()
        }  # fmt: skip
        self.page.add_init_script(path=packages / "iwer" / "build" / "iwer.min.js")
        self.page.add_init_script(EMULATION % json.dumps(hands))
        self.page.goto(device.url)
        self.page.wait_for_selector("body[data-scene=loaded]")
        self.place, self.turned = np.array([0.25, 1.1, -0.35]), np.eye(3)
        self.part = "hands.right" if bare else "controllers.right"
        self.tell(
            "device.position.set(0, 1.6, 0); device.quaternion.set(-0.26, 0, 0, 0.97)"
        )
        if bare:
            self.tell("device.primaryInputMode = 'hand'")

    def tell(self, script):
        return self.page.evaluate(script)

    def enter(self):
        self.page.get_by_role("button", name="Enter VR").click()
        self.page.wait_for_selector("body[data-session=immersive-vr]")
        self.show()

    def show(self):
        """Hold the right hand where it is meant to be, in the axes of WebXR."""
        x, y, z, w = pin.Quaternion(self.turned).coeffs()
        places = ", ".join(map(str, self.place))
        self.tell(
            f"device.{self.part}.position.set({places});"
            f"device.{self.part}.quaternion.set({x}, {y}, {z}, {w})"
        )

    def press(self, button, value, side="right"):
        self.tell(f"device.controllers.{side}.updateButtonValue('{button}', {value})")

    def move(self, step):
        """Move the hand by a step in the robot's world, m."""
        self.place = self.place + TO_FRAME.T @ step
        self.show()

    def turn(self, rotation):
        """Turn the hand about its wrist by a rotation in the robot's world."""
        rotation = TO_FRAME.T @ rotation @ TO_FRAME
        wrist = around(OPEN)[0, :3, 3] * (-1.0, 1.0, 1.0)
        before = self.turned @ wrist
        self.turned = rotation @ self.turned
        self.place = self.place + before - self.turned @ wrist
        self.show()

    def close(self, aperture):
        share = (OPEN - aperture) / (OPEN - CLOSED)
        self.tell(f"device.{self.part}.updatePinchValue({min(1, max(0, share))})")


@pytest.fixture
def wearer(context, room, packages):
    session, device = room
    session.reset()
    wearer = Wearer(context, device, packages)
    wearer.enter()
    wait_until(lambda: not follows(session), "the frames of this page are read")
    yield wearer
    assert wearer.faults == []
    assert device.refused == ""
    host = urlsplit(device.url).netloc
    elsewhere = [u for u in wearer.requests if urlsplit(u).netloc not in ("", host)]
    assert elsewhere == []
    assert len(wearer.requests) > 8
    wearer.page.close()


def right(session):
    return session.snapshot.limbs["right_hand"]


def measured(session):
    return right(session).measured.translation.copy()


def follows(session):
    return (
        not session.snapshot.device and "clutch disengaged" not in right(session).acting
    )


def rests(session):
    """Whether the hand has come to rest."""
    before = measured(session)
    time.sleep(0.3)
    return np.linalg.norm(measured(session) - before) < 1e-5


def wait_for_rest(session):
    wait_until(lambda: rests(session), "the hand comes to rest")


def test_page_without_a_headset_shows_address_qr_code_and_steps(
    context, room, packages
):
    _, device = room
    page = context.new_page()
    page.add_init_script(path=packages / "jsqr" / "dist" / "jsQR.js")
    page.set_viewport_size({"width": 800, "height": 1000})
    page.goto(device.url)
    page.wait_for_selector("body[data-scene=loaded]")
    page.get_by_text("No headset was found here").wait_for()
    page.get_by_text("Three ways to connect a headset").click()
    page.get_by_text("adb reverse").wait_for()
    read = page.evaluate("""async () => {
        const picture = document.querySelector('img')
        await picture.decode()
        const pen = Object.assign(document.createElement('canvas'),
                                  {width: 440, height: 440}).getContext('2d')
        pen.drawImage(picture, 0, 0, 440, 440)
        return jsQR(pen.getImageData(0, 0, 440, 440).data, 440, 440).data
    }""")
    assert read == device.url
    ARTIFACTS.mkdir(exist_ok=True)
    page.screenshot(path=str(ARTIFACTS / "headset_page.png"), full_page=True)
    page.close()


def test_squeeze_engages_without_a_jump_and_the_hand_repeats_the_users(room, wearer):
    session, _ = room
    wait_until(lambda: not session.snapshot.device, "the headset is heard")
    wait_for_rest(session)
    start = measured(session)
    wearer.press("squeeze", 1)
    wait_until(lambda: follows(session), "the hand follows")
    wait_for_rest(session)
    assert np.linalg.norm(measured(session) - start) < 1e-3
    wearer.move(np.array([0.0, 0.0, 0.08]))
    wait_until(lambda: measured(session)[2] > start[2] + 0.07, "the hand rises")
    wait_for_rest(session)
    np.testing.assert_allclose(measured(session) - start, [0, 0, 0.08], atol=2e-3)
    ARTIFACTS.mkdir(exist_ok=True)
    wearer.page.screenshot(path=str(ARTIFACTS / "headset_session.png"))
    wearer.press("trigger", 1)
    wait_until(
        lambda: session.snapshot.grippers["right_gripper"].min() > 0.99, "it closes"
    )
    wearer.press("squeeze", 0)
    wait_until(lambda: not follows(session), "it lets go")
    wearer.move(np.array([0.1, 0.0, 0.0]))
    wearer.press("squeeze", 1)
    wait_until(lambda: follows(session), "the hand follows again")
    wait_for_rest(session)
    np.testing.assert_allclose(measured(session) - start, [0, 0, 0.08], atol=2e-3)


@pytest.mark.sweep
def test_hand_that_cannot_follow_is_red_and_pulses(room, wearer):
    session, _ = room
    wearer.press("squeeze", 1)
    wait_until(lambda: follows(session), "the hand follows")
    wait_until(lambda: wearer.tell(COUNT_PULSES), "there is a motor")
    state = "headset.status.hands?.right_hand?.state"

    def stays_red():  # a hand that is on its way may be red for a moment
        before = wearer.tell(state)
        time.sleep(1.0)
        return before == wearer.tell(state) == "unreachable"

    for _ in range(30):  # as slowly as software draws: no step counts as a jump
        if stays_red():
            break
        wearer.move(np.array([0.05, 0.0, 0.0]))
    wait_until(stays_red, "it is red")
    wait_until(lambda: wearer.tell("pulses") > 0, "the controller pulses")
    assert "Right hand cannot follow" in wearer.tell("headset.status.text")
    wearer.page.screenshot(path=str(ARTIFACTS / "headset_unreachable.png"))


def test_hand_that_is_not_seen_lets_go(room, wearer):
    session, _ = room
    wearer.press("squeeze", 1)
    wait_until(lambda: follows(session), "the hand follows")
    wait_for_rest(session)
    start = measured(session)
    wearer.tell("lost = true")
    wait_until(lambda: not follows(session), "it lets go")
    wearer.move(np.array([0.0, 0.2, 0.1]))
    wearer.tell("lost = false")
    wait_until(lambda: follows(session), "the hand follows again")
    wait_for_rest(session)
    assert np.linalg.norm(measured(session) - start) < 1e-3


@pytest.mark.sweep
def test_page_that_draws_for_long_keeps_its_connection(wearer):
    socket = wearer.page.evaluate_handle("headset.connection.socket")
    for _ in range(3):
        wearer.tell("{ const end = Date.now() + 3000; while (Date.now() < end); }")
        time.sleep(0.7)  # two checks, and what came meanwhile
    assert wearer.page.evaluate("kept => kept === headset.connection.socket", socket)


def test_lost_connection_stops_the_robot_and_is_taken_up_again(room, wearer):
    session, device = room
    wearer.press("squeeze", 1)
    wait_until(lambda: follows(session), "the hand follows")
    wait_for_rest(session)
    device.stop()
    wait_until(lambda: session.snapshot.device, "the loss is noticed")
    wait_for_rest(session)
    start = measured(session)
    wearer.move(np.array([0.1, 0.1, 0.1]))
    wearer.page.get_by_text("Waiting for the robot").wait_for(state="attached")
    device.start()
    began = time.monotonic()
    wait_until(lambda: not session.snapshot.device, "it is connected again")
    note(headset_reconnects_after=round(time.monotonic() - began, 2))
    wearer.move(np.array([0.0, 0.0, 0.05]))  # still squeezed, but not again
    wait_for_rest(session)
    assert not follows(session)
    assert np.linalg.norm(measured(session) - start) < 1e-3
    wearer.press("squeeze", 0)
    wait_until(lambda: wearer.tell("!headset.hands.right.waits"), "it is released")
    wearer.press("squeeze", 1)
    wait_until(lambda: follows(session), "the hand follows again")
    wait_for_rest(session)
    assert np.linalg.norm(measured(session) - start) < 1e-3
    wearer.move(np.array([0.0, 0.0, 0.05]))
    wait_until(lambda: measured(session)[2] > start[2] + 0.045, "it goes on")


def test_thumbstick_drives_while_its_trigger_is_held(wearer):
    read = """async () => {
        const { readControls } = await import('./hands.js')
        return readControls(headset.session.inputSources).base
    }"""
    wearer.tell("device.controllers.left.updateAxes('thumbstick', 0, -1)")
    wait_until(
        lambda: wearer.tell(
            "[...headset.session.inputSources].some(s => s.gamepad.axes[3] < -0.9)"
        ),
        "the stick is pushed",
    )
    assert wearer.tell(read) == [0, 0, 0]
    wearer.press("trigger", 1, side="left")
    wait_until(lambda: wearer.tell(read)[0] > 0.5, "it drives")
    wearer.press("trigger", 0, side="left")
    wait_until(lambda: wearer.tell(read) == [0, 0, 0], "it stops")
    wearer.tell("device.controllers.left.updateAxes('thumbstick', 0, 0)")


@pytest.mark.sweep
def test_cube_is_lifted_with_a_tracked_hand(context, room, packages):
    session, device = room
    session.reset()
    wearer = Wearer(context, device, packages, bare=True)
    wearer.enter()
    wait_until(lambda: not follows(session), "the frames of this page are read")
    wait_until(lambda: not session.snapshot.device, "the headset is heard")
    wearer.tell("device.hands.right.poseId = 'sign'")
    wait_until(lambda: follows(session), "thumb on little finger: it follows")
    wearer.tell("device.hands.right.poseId = 'default'")
    person = HandOperator(session, wearer)
    began = session.snapshot.time
    person.move_to(person.between + APPROACH, 60)
    person.turn_to(person.from_above(), 120)
    person.move_to(person.cube_place + APPROACH, 60)
    person.move_to(person.cube_place + INTO, 60)
    person.close(OPEN, CLOSED, 2.5)
    wait_until(
        lambda: session.snapshot.grippers["right_gripper"][2] > 0.0, "fingers close"
    )
    time.sleep(1.0)
    wearer.page.screenshot(path=str(ARTIFACTS / "headset_grasp.png"))
    height = person.cube_place[2]
    person.move_to(person.between + RISE, 60, near=0.03)
    assert person.cube_place[2] > height + 0.1
    assert session.snapshot.success
    note(headset_cube_lifted_in=round(session.snapshot.time - began, 1))
    wearer.page.screenshot(path=str(ARTIFACTS / "headset_lift.png"))
    assert wearer.faults == []
    wearer.page.close()
