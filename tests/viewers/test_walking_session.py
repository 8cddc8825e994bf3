"""Sessions with robots that walk or drive: velocity, hands, balance, falls."""

import time

import numpy as np
import pinocchio as pin
import pytest
from websockets.sync.client import connect

import wbc_suite
from wbc_suite.viewers.held_keys import SOCKET
from wbc_suite.viewers.page_process import PageProcess
from wbc_suite.viewers.teleop_session import DRIVE_TIMEOUT, TeleopSession

pytestmark = pytest.mark.slow

RATE = 50.0
PAGE, OTHER = -1, -2
BACK = np.array([-0.4, 0.0, 0.0, 0.0])


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


class Player:
    """A session in simulated time, and a client that drives."""

    def __init__(self, robot, controller="WHOLE_BODY_ID"):
        self.env = wbc_suite.make(
            "Lift",
            robots=robot,
            controller_configs=controller,
            control_freq=RATE,
            horizon=10**6,
        )
        self.clock = Clock()
        self.session = TeleopSession(self.env, period=1.0 / RATE, clock=self.clock)

    def run(self, seconds, velocity=None, *, client=PAGE):
        """Step; a velocity is repeated every 0.1 s after zeros, as pages do."""
        if velocity is not None:
            self.session.drive(client, np.zeros(4))
        for k in range(round(seconds * RATE)):
            if velocity is not None and k % 5 == 0:
                self.session.drive(client, velocity)
            self.session.tick()
            self.clock.now += 1.0 / RATE
        return self.session.snapshot

    @property
    def place(self):
        return self.env.unwrapped.simulation.robots[0].root_pose.translation.copy()

    @property
    def yaw(self):
        R = self.env.unwrapped.simulation.robots[0].root_pose.rotation
        return float(np.arctan2(R[1, 0], R[0, 0]))

    def push(self, force, seconds):
        simulation = self.env.unwrapped.simulation
        body = simulation.model.body("robot0_base_link").id
        simulation.data.xfrc_applied[body, :3] = force
        self.run(seconds)
        simulation.data.xfrc_applied[body] = 0.0


@pytest.fixture(scope="module")
def gr1():
    player = Player("GR1FreeBody")
    yield player
    player.env.close()


@pytest.fixture
def standing(gr1):
    gr1.session.reset()
    gr1.session.ride(True)
    gr1.run(0.5)
    return gr1


def test_humanoid_walks_while_a_key_is_held_and_then_stands(standing):
    start = standing.place
    snapshot = standing.run(3.0, BACK)
    walked = standing.place - start
    assert -1.2 < walked[0] < -0.6
    np.testing.assert_allclose(snapshot.velocity, BACK, atol=1e-3)
    standing.session.drive(PAGE, np.zeros(4))
    standing.run(2.5)
    stopped = standing.place
    assert not standing.run(1.0).velocity.any()
    assert np.linalg.norm(standing.place - stopped) < 0.02
    assert standing.session.snapshot.fell == ""


def test_robot_stops_when_messages_stop(standing):
    standing.run(1.5, BACK)
    assert standing.run(DRIVE_TIMEOUT - 0.1).velocity[0] == pytest.approx(
        -0.4, abs=0.01
    )
    assert abs(standing.run(0.7).velocity[0]) < 0.01


def test_only_the_first_client_drives_and_leaving_stops(standing):
    standing.run(1.0, BACK)
    standing.session.drive(OTHER, -BACK)
    assert standing.run(0.2).velocity[0] < 0.0
    standing.session.leave(PAGE)
    assert abs(standing.run(0.7).velocity[0]) < 0.01
    assert standing.run(0.6, -0.5 * BACK, client=OTHER).velocity[0] > 0.1


def test_hands_go_with_the_body_or_stay_in_the_world(standing):
    def hand():
        return standing.session.snapshot.limbs["right_hand"]

    before, place = hand().target.translation, standing.place
    standing.run(2.0, BACK)
    carried = hand().target.translation - before
    assert carried[0] == pytest.approx((standing.place - place)[0], abs=0.06)
    assert hand().position_error < 0.03
    standing.session.drive(PAGE, np.zeros(4))
    standing.run(2.0)
    standing.session.ride(False)
    held = hand().target.translation
    standing.run(1.0, 0.25 * BACK)
    np.testing.assert_allclose(hand().target.translation, held, atol=1e-6)
    assert hand().position_error < 0.03


def test_target_that_is_let_go_out_of_reach_returns_to_its_hand(standing):
    session, name = standing.session, "right_hand"
    start = session.snapshot.limbs[name].target
    far = pin.SE3(start.rotation, start.translation - np.array([0.0, 1.0, 0.0]))
    session.grab(name, PAGE, start)
    session.drag(name, PAGE, far)
    assert standing.run(0.2).limbs[name].position_error > 0.15
    session.release(name, PAGE)
    status = standing.run(6.0).limbs[name]
    assert status.position_error < 0.03
    assert standing.session.snapshot.fell == ""
    reach = np.linalg.norm(status.target.translation - start.translation)
    assert 0.1 < reach < 0.8


def test_height_is_lowered_by_a_key_and_kept(standing):
    start = standing.place[2]
    standing.run(1.0, np.array([0.0, 0.0, 0.0, -0.1]))
    standing.session.drive(PAGE, np.zeros(4))
    standing.run(1.0)
    lowered = standing.place[2]
    assert -0.13 < lowered - start < -0.05
    standing.run(1.0)
    assert standing.place[2] == pytest.approx(lowered, abs=0.01)


def test_balance_is_published_for_those_who_watch(standing):
    assert standing.session.snapshot.balance is None
    standing.session.watch_balance(PAGE, True)
    balance = standing.run(0.5).balance
    assert [foot.stands for foot in balance.feet] == [True, True]
    assert balance.footstep is None
    assert balance.margin > 0.0
    middle = np.mean([foot.position for foot in balance.feet], axis=0)
    np.testing.assert_allclose(balance.capture_point, middle, atol=0.08)
    np.testing.assert_allclose(
        balance.forces.sum(axis=0), [0, 0, balance.weight], atol=0.1 * balance.weight
    )
    steps = [standing.run(0.04, BACK).balance for _ in range(40)]
    assert {sum(foot.stands for foot in b.feet) for b in steps} == {1, 2}
    assert any(b.footstep is not None for b in steps)
    standing.session.leave(PAGE)
    assert standing.run(0.1).balance is None


def test_fall_is_reported_once_and_a_reset_ends_it(standing):
    standing.push([900.0, 900.0, 0.0], 1.2)
    snapshot = standing.run(1.0, BACK)
    assert snapshot.fell.startswith("It fell")
    assert standing.run(0.3).fell == snapshot.fell  # though it tilts on
    standing.session.reset()
    snapshot = standing.run(1.0)
    assert snapshot.fell == ""
    assert standing.place[2] > 0.8
    assert not snapshot.velocity.any()
    start = standing.place
    standing.run(2.0, BACK)
    assert (standing.place - start)[0] < -0.3


def test_quadruped_without_hands_walks_and_turns():
    player = Player("Spot")
    assert not player.session.info.limbs
    assert not player.session.info.rides
    player.run(0.5)
    player.run(2.0, np.array([-0.5, 0.0, 0.5, 0.0]))
    assert player.yaw > 0.5
    assert player.place[0] < -0.4
    player.env.close()


@pytest.mark.parametrize("robot", ["Tiago", "PandaOmron"])
def test_wheels_are_driven_by_the_same_keys(robot):
    player = Player(robot, "WHOLE_BODY_IK")
    info = player.session.info
    assert (info.drive[:3] > 0.0).all()
    assert not info.walks
    player.run(0.5)
    start = player.place
    player.run(2.0, BACK)
    assert -0.9 < (player.place - start)[0] < -0.5
    player.session.drive(PAGE, np.zeros(4))
    player.run(2.0)
    stopped = player.place
    player.run(0.5)
    assert np.linalg.norm(player.place - stopped) < 0.01
    player.env.close()


def test_arm_on_a_table_has_nothing_to_drive():
    player = Player("Panda", "WHOLE_BODY_IK")
    assert not player.session.info.drive.any()
    player.env.close()


def test_page_in_its_own_process_drives_and_its_end_stops_the_robot():
    env = wbc_suite.make(
        "Lift",
        robots="Spot",
        controller_configs="WHOLE_BODY_ID",
        control_freq=RATE,
        horizon=10**6,
    )
    session = TeleopSession(env, period=1.0 / RATE)
    session.tick()  # the loop is compiled
    page = PageProcess("127.0.0.1", 0, label="Spot")
    session.start()
    try:
        page.attach(session)
        address = page.url.replace("http", "ws").rstrip("/") + SOCKET
        with connect(address) as socket:

            def is_driven():
                socket.send("[-1, 0, 0, 0]")
                return session.snapshot.velocity[0] < -0.3

            socket.send("[0, 0, 0, 0]")
            wait_until(is_driven)
            wait_until(lambda: not session.snapshot.velocity.any())  # no more messages
            assert not is_driven()  # the same key again, which was not released
            wait_until(lambda: session.snapshot.drive_waits)
            assert not session.snapshot.velocity.any()
            socket.send("[0, 0, 0, 0]")
            wait_until(is_driven)
        wait_until(lambda: not session.snapshot.velocity.any())
        assert session.running
    finally:
        session.stop()
        page.stop()
        env.close()


def wait_until(condition, patience=120.0):
    deadline = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)
