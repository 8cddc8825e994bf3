"""Driving: a command that has to be repeated, its ramp, its bounds, and the height."""

import numpy as np
import pytest
from floating import FloatingEnv

from wbc_suite.control.action import ActionLayout, ActionPart, SliceKind, Unit
from wbc_suite.devices import DeviceState, Pipeline, PipelineConfig
from wbc_suite.devices.action_ports import height_slices, speed_ports
from wbc_suite.devices.pipeline.drive import HeldCommand

DT = 0.01
MOST = (1.0, 0.4, 1.0)
ALICE, BOB = -1, -2
RISE = PipelineConfig().base_rise


class WalkingEnv(FloatingEnv):
    """Two hands, and slices that command a walk."""

    def __init__(self):
        super().__init__()
        walk = ActionPart(
            name="walk",
            kind=SliceKind.VELOCITY,
            labels=("forward", "sideways", "turn"),
            units=(Unit("m/s"), Unit("m/s"), Unit("rad/s")),
            low=tuple(-x for x in MOST),
            high=MOST,
        )
        height = ActionPart(
            name="height",
            kind=SliceKind.POSITION,
            labels=("z",),
            units=(Unit("m"),),
            low=(-0.15,),
            high=(0.02,),
        )
        hands = [s for s in self.action_layout.slices if s.kind == "pose"]
        self.action_layout = ActionLayout([*hands, walk, height])


class Driver:
    """Drives at the pipeline's rate."""

    def __init__(self, **config):
        self.env = WalkingEnv()
        config = {"base_speed": (2.0, 2.0), "ramp": 0.0} | config
        self.time = self.now = 0.0
        self.pipeline = Pipeline(
            self.env, PipelineConfig(**config), clock=lambda: self.now
        )

    def drive(self, velocity, ticks, *, base=None):
        """Return walk and height of each tick, shape (ticks, 4)."""
        rows = []
        for _ in range(ticks):
            self.time += DT
            self.now += DT
            state = DeviceState(time=self.time, base=base)
            action = self.pipeline.update(state, np.array(velocity, dtype=float))
            values = self.env.action_layout.unpack(action)
            rows.append([*values["walk"], *values["height"]])
        return np.array(rows)


@pytest.fixture
def driver():
    return Driver()


def test_walk_and_height_are_found_with_their_bounds():
    env = WalkingEnv()
    assert [*speed_ports(env)] == ["walk"]
    np.testing.assert_allclose(speed_ports(env)["walk"].limits, MOST)
    assert [*height_slices(env)] == ["height"]


@pytest.mark.parametrize(
    "velocity", [(0.8, 0, 0, 0), (0, 0, -0.7, 0), (0.5, 0.3, 1, 0)]
)
def test_velocity_rises_smoothly_to_what_is_commanded(driver, velocity):
    walk = driver.drive(velocity, 200)[:, :3]
    np.testing.assert_allclose(walk[-1], velocity[:3], atol=1e-3)
    change = np.diff(walk, axis=0, prepend=0.0) / DT
    assert np.linalg.norm(change, axis=1).max() < RISE.speed + 1e-9
    jolt = np.linalg.norm(np.diff(change, axis=0, prepend=0.0), axis=1) / DT
    assert jolt.max() < RISE.acceleration + 1e-9
    assert np.abs(walk[9]).max() < 0.2  # after 0.1 s it has only begun


def test_velocity_falls_smoothly_to_exactly_zero_when_a_key_is_released(driver):
    before = driver.drive((0.8, 0.0, 0.5, 0.0), 200)[-1, :3]
    walk = driver.drive(np.zeros(4), 200)[:, :3]
    steps = np.diff(walk, axis=0, prepend=before[None])
    assert np.linalg.norm(steps, axis=1).max() < RISE.speed * DT + 1e-9
    assert (np.linalg.norm(walk[70:], axis=1) < 0.01).all()
    assert not walk[-1].any()


def test_velocity_keeps_the_bounds_of_the_action(driver):
    walk = driver.drive((9.0, 9.0, -9.0, 0.0), 300)
    assert (np.abs(walk[:, :3]) <= MOST).all()
    np.testing.assert_allclose(np.abs(walk[-1, 1:3]), MOST[1:], atol=1e-3)


def test_settings_of_the_pipeline_bound_the_velocity_too():
    walk = Driver(base_speed=(0.3, 0.2)).drive((1.0, 0.0, 1.0, 0.0), 300)
    np.testing.assert_allclose(walk[-1, [0, 2]], [0.3, 0.2], atol=1e-3)


def test_height_moves_while_commanded_stays_and_keeps_its_bounds(driver):
    down = driver.drive((0, 0, 0, -0.1), 100)[:, 3]
    assert (np.diff(down) <= 0.0).all()
    assert -0.1 < down[-1] < -0.05
    held = driver.drive(np.zeros(4), 200)[:, 3]
    assert held[-1] == held[100]
    assert driver.drive((0, 0, 0, -0.1), 400)[-1, 3] == -0.15
    assert driver.drive((0, 0, 0, 0.1), 400)[-1, 3] == 0.02


def test_a_device_that_drives_goes_before_the_page(driver):
    walk = driver.drive((0.5, 0, 0, 0), 200, base=np.array([0.0, 0.0, 0.4]))[-1]
    np.testing.assert_allclose(walk[:3], [0.0, 0.0, 0.4], atol=1e-3)
    walk = driver.drive((0.5, 0, 0, 0), 200, base=np.zeros(3))[-1]
    np.testing.assert_allclose(walk[:3], [0.5, 0.0, 0.0], atol=1e-3)


def test_a_silent_device_stops_what_it_drove_and_the_page_still_drives(driver):
    driver.drive(np.zeros(4), 100, base=np.array([0.5, 0.0, 0.0]))
    for velocity, expected in ((0.0, 0.0), (-0.3, -0.3)):
        for _ in range(200):  # its time stands still
            driver.now += DT
            action = driver.pipeline.update(
                DeviceState(time=driver.time), np.array([velocity, 0, 0, 0])
            )
        walk = driver.env.action_layout.unpack(action)["walk"]
        np.testing.assert_allclose(walk, [expected, 0, 0], atol=1e-3)


def test_reset_stops_at_once(driver):
    driver.drive((0.8, 0, 0, -0.1), 100)
    driver.pipeline.reset()
    assert not driver.drive(np.zeros(4), 1).any()


def command():
    held = HeldCommand(4, timeout=0.5)
    for client in (ALICE, BOB):
        held.set(np.zeros(4), client=client, now=0.0)
    return held


def test_command_that_is_not_repeated_ends():
    held = command()
    for k in range(10):
        assert held.set([1, 0, 0, 0], client=ALICE, now=0.1 * k)
    np.testing.assert_array_equal(held.read(0.9 + 0.49), [1, 0, 0, 0])
    assert not held.read(0.9 + 0.51).any()
    assert not held.read(0.9).any()  # it does not come back by itself


def test_zeros_end_a_command_at_once():
    held = command()
    held.set([0, 1, 0, 0], client=ALICE, now=0.0)
    held.set(np.zeros(4), client=ALICE, now=0.1)
    assert not held.read(0.1).any()


def test_one_client_drives_until_it_ends_or_leaves():
    held = command()
    assert held.set([1, 0, 0, 0], client=ALICE, now=0.0)
    assert not held.set([-1, 0, 0, 0], client=BOB, now=0.1)
    assert not held.set(np.zeros(4), client=BOB, now=0.1)
    held.leave(BOB)
    np.testing.assert_array_equal(held.read(0.2), [1, 0, 0, 0])
    held.leave(ALICE)
    assert not held.read(0.2).any()
    held.set(np.zeros(4), client=BOB, now=0.3)
    assert held.set([-1, 0, 0, 0], client=BOB, now=0.3)
    held.set(np.zeros(4), client=ALICE, now=0.9)
    assert held.set([1, 0, 0, 0], client=ALICE, now=0.9)  # Bob is silent


FORWARD = [1.0, 0, 0, 0]


def test_first_command_of_a_client_counts_once_it_has_sent_zeros():
    held = HeldCommand(4, timeout=0.5)
    assert not held.set(FORWARD, client=ALICE, now=0.0)  # held while it connects
    assert not held.read(0.0).any()
    assert held.waits(0.1)
    held.set(np.zeros(4), client=ALICE, now=0.2)
    assert held.set(FORWARD, client=ALICE, now=0.3)
    assert not held.waits(0.6)


@pytest.mark.parametrize("end", ["silence", "clear", "leave", "other"])
def test_key_that_is_held_while_its_command_ends_has_to_be_pressed_anew(end):
    """After silence, a pause or a reset, on a new connection, or after another one."""
    held, now = command(), 1.0
    if end == "other":
        held.set(FORWARD, client=BOB, now=0.0)
        assert not held.set(FORWARD, client=ALICE, now=0.1)
        held.set(np.zeros(4), client=BOB, now=0.2)
    else:
        held.set(FORWARD, client=ALICE, now=0.0 if end == "silence" else 0.9)
    if end == "clear":
        held.clear()
    if end == "leave":
        held.leave(ALICE)
    for _ in range(5):
        now += 0.1
        assert not held.set(FORWARD, client=ALICE, now=now)
        assert not held.read(now).any()
    held.set(np.zeros(4), client=ALICE, now=now)
    assert held.set(FORWARD, client=ALICE, now=now)
    np.testing.assert_array_equal(held.read(now), FORWARD)


@pytest.mark.parametrize("bad", [[np.nan, 0, 0, 0], [np.inf, 0, 0, 0], [1, 0], 1.0])
def test_invalid_commands_change_nothing(bad):
    held = command()
    held.set([0.5, 0, 0, 0], client=ALICE, now=0.0)
    assert not held.set(bad, client=ALICE, now=0.1)
    np.testing.assert_array_equal(held.read(0.2), [0.5, 0, 0, 0])
