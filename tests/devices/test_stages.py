"""The stages of the pipeline, one by one."""

import math

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.devices import DeviceState, LimbInput
from wbc_suite.devices.pipeline.config import Leash, OneEuro, WorkspaceBox
from wbc_suite.devices.pipeline.limb_pipeline import (
    OneEuroFilter,
    clip_to_box,
    clip_to_leash,
)
from wbc_suite.devices.pipeline.pipeline import LimbSelector
from wbc_suite.devices.pipeline.watchdog import Phase, Watchdog
from wbc_suite.devices.state import mirrored

DT = 0.01
BOX = WorkspaceBox(low=(0.0, -1.0, 0.0), high=(1.0, 1.0, 2.0))


def pose(x=0.0, y=0.0, z=0.0, turn=(0.0, 0.0, 0.0)):
    return pin.SE3(pin.exp3(np.array(turn, dtype=float)), np.array([x, y, z]))


def state(time, **values):
    return DeviceState(time=time, **values)


@pytest.mark.parametrize(
    ("point", "expected", "clipped"),
    [
        ((0.5, 0.0, 1.0), (0.5, 0.0, 1.0), False),
        ((1.5, 0.0, -3.0), (1.0, 0.0, 0.0), True),
        ((0.5, -1.0, 1.0), (0.5, -1.0, 1.0), True),  # on the boundary
    ],
)
def test_box_moves_a_target_to_its_nearest_point(point, expected, clipped):
    target, at_boundary = clip_to_box(pose(*point, turn=(0, 0, 1)), BOX)
    np.testing.assert_allclose(target.translation, expected)
    np.testing.assert_allclose(pin.log3(target.rotation), [0, 0, 1])
    assert at_boundary is clipped


def test_leash_shortens_distance_and_angle_each_along_its_direction():
    measured = pose(0.1, 0.2, 0.3, turn=(0, 0, 0.5))
    wanted = pose(0.1, 0.2, 1.3, turn=(0, 0, 2.0))
    target, tight = clip_to_leash(wanted, measured, Leash(distance=0.25, angle=1.0))
    assert tight
    np.testing.assert_allclose(target.translation, [0.1, 0.2, 0.55])
    np.testing.assert_allclose(pin.log3(target.rotation), [0, 0, 1.5])


def test_leash_leaves_a_target_within_it_alone():
    wanted = pose(0.1, turn=(0.2, 0, 0))
    target, tight = clip_to_leash(wanted, pose(), Leash(distance=0.25, angle=1.0))
    assert not tight
    assert target.isApprox(wanted, 1e-12)


def test_leash_of_one_quantity_does_not_change_the_other():
    wanted = pose(5.0, turn=(0.9, 0, 0))
    target, tight = clip_to_leash(wanted, pose(), Leash(distance=0.5, angle=1.0))
    assert tight
    np.testing.assert_array_equal(target.rotation, wanted.rotation)
    assert np.linalg.norm(target.translation) == pytest.approx(0.5)


@pytest.mark.parametrize("box", [{"low": (0, 0, 0), "high": (1, 0, 1)}])
def test_empty_box_is_refused(box):
    with pytest.raises(ValueError, match="low must be below high"):
        WorkspaceBox(**box)


def filtered(points, config):
    smooth = OneEuroFilter(config, DT)
    return np.array([smooth.apply(pose(x)).translation[0] for x in points])


def test_one_euro_filter_of_no_rise_is_a_first_order_low_pass():
    config = OneEuro(cutoff=2.0, linear_rise=0.0, angular_rise=0.0)
    found = filtered(np.ones(30), config)
    alpha = 1.0 / (1.0 + 1.0 / (2.0 * math.pi * 2.0 * DT))
    np.testing.assert_allclose(found, 1.0 - (1.0 - alpha) ** np.arange(1, 31))


def test_one_euro_filter_damps_tremor_and_follows_fast_motion():
    times = DT * np.arange(400)
    tremor = 0.001 * np.sin(2 * np.pi * 10.0 * times)
    assert np.abs(filtered(tremor, OneEuro())[200:]).max() < 0.0006
    fast = np.minimum(times, 1.0)  # 1 m/s
    assert np.abs(filtered(fast, OneEuro()) - fast)[50:100].max() < 0.02


def test_one_euro_filter_turns_along_the_shortest_arc():
    smooth = OneEuroFilter(OneEuro(), DT)
    smooth.reset(pose(turn=(0, 0, 3.0)))
    found = smooth.apply(pose(turn=(0, 0, -3.0)))  # 0.28 rad on, not 6 rad back
    turned = pin.log3(found.rotation @ pose(turn=(0, 0, 3.0)).rotation.T)
    assert 0.0 < turned[2] < 2 * np.pi - 6.0


class Watch:
    """A watchdog on a clock that advances by a period at each check.

    Args:
        times: Of the states that it reads first, s.
        ticks: How often each is read.

    Attributes:
        new: How many of these were new.
    """

    def __init__(self, *times, ticks=1):
        self.now, self.dog = 50.0, Watchdog(0.055, 0.205, lambda: self.now)
        read = [self.check(time) for time in times for _ in range(ticks)]
        self.new = sum(state is not None for state in read)

    def check(self, time, *, after=DT, **values):
        self.now += after
        return self.dog.check(state(time, **values))

    @property
    def phase(self):
        return self.dog.phase

    @property
    def acting(self):
        return self.dog.acting


def test_watchdog_waits_for_a_first_state_without_returning():
    watch = Watch(*[math.nan] * 100)
    assert watch.new == 0
    assert (watch.phase, watch.acting) == (Phase.HOLD, "waiting for the device")


def test_watchdog_reads_a_repeated_state_once():
    watch = Watch(1.0, 2.0, ticks=3)
    assert watch.new == 2
    assert (watch.phase, watch.acting) == (Phase.LIVE, "")


def test_watchdog_holds_and_then_returns():
    watch, phases = Watch(1.0), []
    for _ in range(25):
        watch.check(1.0)
        phases.append(watch.phase)
    assert phases == [Phase.LIVE] * 5 + [Phase.HOLD] * 15 + [Phase.RETURN] * 5


def test_watchdog_measures_silence_by_its_clock_and_not_by_calls():
    watch = Watch(1.0)
    watch.check(1.0, after=0.05)  # a loop that runs at 20 Hz in place of 100
    assert watch.phase is Phase.LIVE
    watch.check(1.0, after=0.05)
    assert watch.phase is Phase.HOLD
    watch.check(1.0, after=0.2)
    assert watch.phase is Phase.RETURN
    assert watch.check(1.3, after=5.0) is not None  # it has sent something meanwhile
    assert watch.phase is Phase.LIVE


def test_watchdog_reports_time_that_goes_backwards_until_it_advances():
    watch = Watch(5.0, 4.0)
    assert watch.new == 1
    assert "backwards" in watch.acting
    assert watch.check(5.1) is not None
    assert watch.acting == ""


def test_watchdog_accepts_a_restarted_device_after_the_hold():
    watch = Watch(*[5.0] * 11)
    assert watch.phase is Phase.HOLD
    watch.check(0.01)
    assert watch.check(0.02) is not None
    assert watch.phase is Phase.LIVE


@pytest.mark.parametrize(
    "values",
    [
        {"height": math.inf},
        {"base": np.array([0.0, math.nan, 0.0])},
        {"joints": {"elbow": math.nan}},
        {"limbs": {"right": LimbInput(twist=np.full(6, math.nan))}},
        {"limbs": {"right": LimbInput(pose=pose(math.inf))}},
        {"limbs": {"right": LimbInput(fingers=np.full((25, 3), math.nan))}},
    ],
)
def test_watchdog_refuses_every_number_that_is_not_finite(values):
    watch = Watch(1.0)
    assert watch.check(2.0, **values) is None
    assert "invalid numbers" in watch.acting


LIMBS = [f"robot{i}_{name}" for i in range(2) for name in ("head", "right", "left")]


@pytest.fixture
def selector():
    return LimbSelector(LIMBS, [name for name in LIMBS if "head" not in name])


def test_selector_finds_limbs_of_the_selected_robot(selector):
    assert selector.find("hand") == "robot0_right"
    assert selector.find("left") == "robot0_left"
    assert selector.find("head") == "robot0_head"
    assert selector.find("robot1_head") == "robot1_head"
    assert selector.find("tail") is None


def test_selector_goes_through_hands_only_and_starts_again(selector):
    found = [selector.next() for _ in range(4)]
    assert found == ["robot0_left", "robot1_right", "robot1_left", "robot0_right"]


def test_selector_of_another_robot_finds_its_sides(selector):
    selector.next()
    selector.next()
    assert selector.find("left") == "robot1_left"


def test_selector_without_limbs_selects_nothing():
    empty = LimbSelector([], [])
    assert empty.selected == ""
    assert empty.find("hand") is None


def test_mirror_is_its_own_inverse_and_flips_y():
    limb = LimbInput(pose=pose(0.1, 0.2, 0.3, turn=(0.1, 0.2, 0.3)), twist=np.arange(6))
    given = state(3.0, limbs={"right": limb}, base=[1.0, 2.0, 3.0], height=0.5)
    once, twice = mirrored(given), mirrored(mirrored(given))
    assert set(once.limbs) == {"left"}
    np.testing.assert_allclose(once.limbs["left"].pose.translation, [0.1, -0.2, 0.3])
    np.testing.assert_array_equal(once.limbs["left"].twist, [0, -1, 2, -3, 4, -5])
    np.testing.assert_array_equal(once.base, [1.0, -2.0, -3.0])
    assert twice.limbs["right"].pose.isApprox(limb.pose, 1e-12)
    assert (once.height, once.time) == (0.5, 3.0)


def test_mirror_commutes_with_the_exponential_of_a_twist():
    """A mirrored motion is the motion of the mirrored twist: rotations flip x and z."""
    omega = np.array([0.3, -0.7, 1.1])
    moved = mirrored(state(0.0, limbs={"left": LimbInput(pose=pose(turn=omega))}))
    turned = pin.log3(moved.limbs["right"].pose.rotation)
    np.testing.assert_allclose(turned, omega * [-1, 1, -1])
