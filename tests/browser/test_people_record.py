"""A person at a real browser, with mouse and keys, records what counts as solved."""

import sys
import time
from contextlib import suppress

import numpy as np
import pinocchio as pin
import pytest
from conftest import PATIENCE, RATE, TRIES, Viewer, note, wait_until

import wbc_suite
from wbc_suite.cli.teleop import stages_of
from wbc_suite.devices.stream import Stream
from wbc_suite.recording import Dataset, rebuild
from wbc_suite.recording.episode_control import EpisodeControl
from wbc_suite.recording.replaying import divergence
from wbc_suite.viewers.loop_timing import SWITCH_INTERVAL
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.teleop_page import TeleopPage
from wbc_suite.viewers.teleop_session import TeleopSession
from wbc_suite.wrappers import DataCollection

pytestmark = [pytest.mark.browser, pytest.mark.slow]

MOVES = (("w", "s"), ("a", "d"), ("r", "f"))
TURNS = (("o", "u"), ("i", "k"), ("j", "l"))
GLANCE = 0.02  # s; between looks at the screen


class Room:
    """A session with its page, its page of keys, and a file.

    Args:
        context: Browser context.
        path: File to record into.
        benchmark: Its name.
        robot: Its name.
        seed: Of what is recorded.
        watching: See `Viewer`.
    """

    def __init__(self, context, path, benchmark, robot, *, seed=0, watching=True):
        env = wbc_suite.make(
            benchmark,
            robots=robot,
            controller_configs="WHOLE_BODY_IK",
            control_freq=RATE,
            horizon=10**7,
        )
        collection = DataCollection(env, path, automatic=False)
        self.env, self.episode_control = (
            collection,
            EpisodeControl(collection.recorder, seed=seed),
        )
        self.stream = Stream(port=0)
        self.stream.start()
        self.session = TeleopSession(
            collection,
            period=1.0 / RATE,
            device=self.stream,
            pipeline=stages_of("stream", scale=1.0, mirror=False).model_copy(
                update={"hold_after": 3.0}  # a busy machine is not a lost connection
            ),
            episode_control=self.episode_control,
        )
        self.session.tick()
        self.page = TeleopPage(
            self.session, PageServer(port=0), label=f"{robot} records"
        )
        self.page.start()
        self.session.start()
        self.viewer = Viewer(context, self.page.site, watching=watching)
        self.keys = context.new_page()
        self.keys.goto(self.stream.url)
        self.keys.get_by_text("connected").wait_for()
        self.held = set()

    def close(self):
        self.session.stop()
        self.page.stop()
        self.stream.stop()
        self.env.close()

    def place(self, body):
        """Where a body is seen."""
        number = self.session.model.body(body).id
        return self.session.snapshot.body_positions[number]

    def site(self, name):
        """Where a site is seen."""
        site, snapshot = self.session.model.site(name), self.session.snapshot
        body = site.bodyid[0]
        quat = pin.Quaternion(np.roll(snapshot.body_quaternions[body], -1))
        return snapshot.body_positions[body] + quat.matrix() @ site.pos

    def limb(self, name):
        return self.session.snapshot.limbs[name]

    def click(self, button, took, what):
        """Click on the robot's page; again where the click was lost, as people do."""
        self.viewer.page.bring_to_front()
        for _ in range(TRIES):
            self.viewer.draw()
            self.viewer.page.get_by_role("button", name=button).click()
            with suppress(AssertionError):
                wait_until(took, what, patience=PATIENCE / TRIES)
                return
        raise AssertionError(f"clicked {TRIES} times in vain: {what}")

    def record(self):
        self.click("Record", lambda: self.recording.recording, "it is recorded")
        self.keys.bring_to_front()

    def keep(self):
        """Press the key, which is quicker than to find the button."""
        self.press("Enter")
        wait_until(lambda: self.recording.kept == 1, "it is kept")

    @property
    def recording(self):
        return self.session.snapshot.recording

    def press(self, key):
        """Press a key, for as long as a finger does."""
        self.keys.keyboard.press(key, delay=80)

    def change_pace(self, key, times):
        for _ in range(times):
            self.press(key)

    def switch_to(self, name):
        while (before := self.session.snapshot.selected) != name:
            self.press("Tab")
            wait_until(
                lambda before=before: self.session.snapshot.selected != before,
                "the next hand",
            )

    def grip(self, name):
        """Close a gripper, and let its fingers press."""
        self.press("Space")
        wait_until(lambda: self.session.grippers[name].min() > 0.9, "it closes")
        self.let_pass(1.0)

    def hold(self, keys):
        """Have these keys down, and no others."""
        for key in self.held - keys:
            self.keys.keyboard.up(key)
        for key in keys - self.held:
            self.keys.keyboard.down(key)
        self.held = set(keys)

    def steer(self, name, goal, *, within, turned=None, near=0.08):
        """Hold keys until a hand is where it should be.

        Args:
            name: The hand's limb, which is switched to.
            goal: Returns where it should be, m; it may move.
            within: How near is enough, along each axis, m.
            turned: How it should be turned, as a matrix; left out, as it is.
            near: How near is enough, about each axis, rad.
        """
        deadline = time.monotonic() + PATIENCE
        while True:
            hand = self.limb(name).measured
            away = goal() - hand.translation
            keys = wanted(MOVES, away, within)
            if turned is not None:
                keys |= wanted(TURNS, pin.log3(turned @ hand.rotation.T), near)
            self.hold(keys)
            if not keys:
                return
            assert time.monotonic() < deadline, f"{name} is {away} m away"
            time.sleep(GLANCE)

    def raise_to(self, name, height):
        """Hold the key until a hand's target is this high, m."""
        self.hold({"r"} if self.limb(name).target.translation[2] < height else set())
        wait_until(
            lambda: self.limb(name).target.translation[2] >= height, "the hand rises"
        )
        self.hold(set())
        self.let_pass(0.2)

    def let_pass(self, seconds):
        """Wait for some time of the simulation, which may run slowly."""
        until = self.session.snapshot.time + seconds
        wait_until(lambda: self.session.snapshot.time > until, "time passes")


def wanted(pairs, away, within):
    """Which key of each pair is to be held, for what is further away than `within`."""
    return {
        pair[int(x < 0.0)]
        for pair, x in zip(pairs, away, strict=True)
        if abs(x) > within
    }


@pytest.fixture
def room(context, tmp_path):
    interval = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL)  # as the command does
    rooms = []

    def enter(benchmark, robot, **options):
        path = tmp_path / "made.hdf5"
        rooms.append(Room(context, path, benchmark, robot, **options))
        return rooms[-1]

    yield enter
    for made in rooms:
        made.close()
    sys.setswitchinterval(interval)


def assert_replays(path):
    """The file's only episode is a success, and comes out the same again."""
    with Dataset(path) as dataset:
        (episode,) = dataset
        assert episode.success
        again = rebuild(dataset)
        assert divergence(again, episode).exact
        again.close()
    return episode.length


def assert_peers_load(readers, path, tmp_path):
    """robomimic's and LeRobot's dataset classes hold the same, where they are there."""
    if not readers.python.exists():
        return
    with Dataset(path) as dataset:
        (episode,) = dataset
    actions = episode.columns["actions"].astype(float).sum()
    robomimic = readers.read("robomimic", path)
    found = readers.convert(path, tmp_path / "lerobot", "lerobot")
    for told in (robomimic, readers.read("lerobot", found)):
        assert told["lengths"] == [episode.length]
        np.testing.assert_allclose(told["actions"], [actions], rtol=1e-5, atol=1e-3)
    assert robomimic["items"] == episode.length
    note(loaded_by_peers=robomimic["environment"])


def test_a_person_lifts_the_cube_and_records_it(room, peer_readers, tmp_path):
    lift = room("Lift", "Panda")
    lift.record()
    cube = lift.session.env.unwrapped.benchmark.states["cube"].body
    name = lift.session.model.body(cube).name
    above = np.array([0.0, 0.0, 0.08])
    lift.steer("right_hand", lambda: lift.place(name) + above, within=0.015)
    lift.change_pace("-", 3)
    lift.steer("right_hand", lambda: lift.place(name), within=0.006)
    lift.grip("right_gripper")
    lift.hold({"r"})
    wait_until(lambda: lift.session.snapshot.success, "the cube is lifted")
    lift.hold(set())
    lift.keep()
    lift.viewer.screenshot("people_lift_panda")
    lift.session.stop()
    lift.env.recorder.close()
    length = assert_replays(tmp_path / "made.hdf5")
    assert_peers_load(peer_readers, tmp_path / "made.hdf5", tmp_path)
    note(actions_of_a_persons_lift=length)


PALM_DOWN = np.array([[0.0, 0, 1], [0, -1, 0], [1, 0, 0]])
SEED = 52  # with it the handles point to the robot's sides
STEP = 0.02  # m; by which one hand may be higher than the other
SPARE = 3  # steps above the height that counts: what is held slips and sags
OUTWARDS = {"right": -1.0, "left": 1.0}
HIGHEST = 1.3  # m; no pot is up there
HANDLES = {"right": "pot_handle0", "left": "pot_handle1"}


def about(axis, angle):
    return pin.exp3(angle * np.eye(3)[axis])


def take_handle(pot, side):
    """Bring a hand over its handle from beside, palm down, and close it."""
    hand, out = f"{side}_hand", OUTWARDS[side]
    turned = about(2, -out * np.pi / 4) @ about(0, out * np.pi / 2) @ PALM_DOWN

    def over(up, outwards, forward=0.03):
        offset = np.array([forward, out * outwards, up])
        return lambda: pot.site(HANDLES[side]) + offset

    pot.switch_to(hand)
    aside = over(0.15, 0.15, forward=-0.05)
    pot.steer(hand, aside, within=0.04)
    pot.steer(hand, aside, within=0.04, turned=turned, near=0.15)
    pot.steer(hand, over(0.05, 0.12), within=0.025, turned=turned, near=0.1)
    pot.change_pace("-", 1)
    pot.steer(hand, over(0.04, 0.01), within=0.01, turned=turned)
    pot.steer(hand, over(0.02, 0.01), within=0.008, turned=turned, near=0.05)
    pot.grip(f"{side}_gripper")
    pot.change_pace("+", 1)


def raise_pot(pot):
    """Take both handles and lift; return whether the pot came along."""
    pot.record()
    pot.change_pace("-", 2)
    for side in HANDLES:
        take_handle(pot, side)
    pot.change_pace("-", 1)
    hands = [f"{side}_hand" for side in HANDLES]
    heights = [pot.limb(hand).target.translation[2] for hand in hands]
    rounds = SPARE
    while rounds and max(heights) < HIGHEST:
        rounds -= pot.session.snapshot.success
        heights = [height + STEP for height in heights]
        for hand, height in zip(hands, heights, strict=True):
            pot.switch_to(hand)
            pot.raise_to(hand, height)
    return pot.session.snapshot.success


@pytest.mark.sweep
def test_a_person_raises_the_pot_with_both_hands_and_records_it(
    room, peer_readers, tmp_path
):
    for attempt in range(TRIES):  # a handle may slip out of a hand
        pot = room("TwoArmLift", "GR1", seed=SEED, watching=False)
        if raise_pot(pot):
            break
        pot.viewer.screenshot(f"people_raise_pot_gr1_in_vain_{attempt}")
        pot.press("Backspace")
        wait_until(lambda pot=pot: not pot.recording.recording, "it is discarded")
        pot.close()
    assert pot.session.snapshot.success
    pot.keep()
    pot.viewer.screenshot("people_raise_pot_gr1")
    pot.session.stop()
    pot.env.recorder.close()
    length = assert_replays(tmp_path / "made.hdf5")
    assert_peers_load(peer_readers, tmp_path / "made.hdf5", tmp_path)
    note(actions_of_a_persons_pot=length, attempts_at_the_pot=attempt + 1)
