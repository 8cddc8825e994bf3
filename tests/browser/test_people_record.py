"""A person at a real browser, with mouse and keys, records what counts as solved."""

import sys
import time

import numpy as np
import pytest
from conftest import RATE, Viewer, note, wait_until

import wbc_suite
from wbc_suite.cli.by_hand import SWITCH_INTERVAL, stages_of
from wbc_suite.devices.stream import Stream
from wbc_suite.recording import Dataset, rebuild
from wbc_suite.recording.desk import RecordingDesk
from wbc_suite.recording.replaying import divergence
from wbc_suite.viewers.site import Site
from wbc_suite.viewers.teleop_page import TeleopPage
from wbc_suite.viewers.teleop_session import TeleopSession
from wbc_suite.wrappers import DataCollection

pytestmark = [pytest.mark.browser, pytest.mark.slow]

PAIRS = (("w", "s"), ("a", "d"), ("r", "f"))
GLANCE = 0.02  # s; between looks at the screen


class Room:
    """A session with its page, its page of keys, and a file."""

    def __init__(self, context, path, benchmark, robot):
        env = wbc_suite.make(
            benchmark,
            robots=robot,
            controller_configs="WHOLE_BODY_IK",
            control_freq=RATE,
            horizon=10**7,
        )
        collection = DataCollection(env, path, automatic=False)
        self.env, self.desk = collection, RecordingDesk(collection.recorder)
        self.stream = Stream(port=0)
        self.stream.start()
        self.session = TeleopSession(
            collection,
            period=1.0 / RATE,
            device=self.stream,
            pipeline=stages_of(device=True, scale=1.0, mirror=False),
            desk=self.desk,
        )
        self.session.tick()
        self.page = TeleopPage(self.session, Site(port=0), label=f"{robot} records")
        self.page.start()
        self.session.start()
        self.viewer = Viewer(context, self.page.site)
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

    def hand(self, name):
        return self.session.snapshot.limbs[name].measured.translation

    def click(self, button):
        self.viewer.page.bring_to_front()
        self.viewer.page.get_by_role("button", name=button).click()

    def hold(self, keys):
        """Have these keys down, and no others."""
        for key in self.held - keys:
            self.keys.keyboard.up(key)
        for key in keys - self.held:
            self.keys.keyboard.down(key)
        self.held = set(keys)

    def steer(self, name, goal, *, within, patience=60.0):
        """Hold keys until a hand is where it should be; the goal may move."""
        deadline = time.monotonic() + patience
        while True:
            away = goal() - self.hand(name)
            keys = {
                pair[int(x < 0.0)]
                for pair, x in zip(PAIRS, away, strict=True)
                if abs(x) > within
            }
            self.hold(keys)
            if not keys:
                return
            assert time.monotonic() < deadline, f"{name} is {away} m away"
            time.sleep(GLANCE)


@pytest.fixture
def room(context, tmp_path):
    interval = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL)  # as the command does
    rooms = []

    def enter(benchmark, robot):
        rooms.append(Room(context, tmp_path / "made.hdf5", benchmark, robot))
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


def test_a_person_lifts_the_cube_and_records_it(room, tmp_path):
    lift = room("Lift", "Panda")
    lift.click("Record")
    wait_until(lambda: lift.session.snapshot.recording.recording, "the recording")
    lift.keys.bring_to_front()
    cube = lift.session.env.unwrapped.benchmark.states["cube"].body
    name = lift.session.model.body(cube).name
    above = np.array([0.0, 0.0, 0.08])
    lift.steer("right_hand", lambda: lift.place(name) + above, within=0.015)
    for _ in range(3):
        lift.keys.keyboard.press("-", delay=80)
    lift.steer("right_hand", lambda: lift.place(name), within=0.006)
    lift.keys.keyboard.press("Space", delay=80)
    wait_until(lambda: lift.session.grippers["right_gripper"][0] > 0.9, "it closes")
    begun = lift.session.snapshot.time
    wait_until(lambda: lift.session.snapshot.time > begun + 0.6, "the fingers press")
    lift.hold({"r"})
    wait_until(lambda: lift.session.snapshot.success, "the cube is lifted")
    lift.hold(set())
    lift.click("Keep")
    wait_until(lambda: lift.session.snapshot.recording.kept == 1, "it is kept")
    lift.viewer.screenshot("people_lift_panda")
    lift.session.stop()
    lift.env.recorder.close()
    length = assert_replays(tmp_path / "made.hdf5")
    note(actions_of_a_persons_lift=length)
