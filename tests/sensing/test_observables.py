"""Observations that differ from the truth, as they were told to."""

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.sensing import reading
from wbc_suite.sensing.noise import (
    GaussianNoise,
    LowPass,
    MovingAverage,
    UniformDelay,
    UniformNoise,
)
from wbc_suite.sensing.observables import Observables

SLIDE = """<mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody><body>
<joint name="x" type="slide"/><joint name="y" type="slide" axis="0 1 0"/>
<geom size="0.1"/></body></worldbody></mujoco>"""
STEPS = 25


class Slide:
    """A body at 1 m/s along x: its place tells the time at which it was seen."""

    def __init__(self, **changes):
        self.model = mujoco.MjModel.from_xml_string(SLIDE)
        self.data = mujoco.MjData(self.model)
        groups = {
            "all": {
                "x": reading.joint_positions([0]),
                "y": reading.joint_positions([1]),
            }
        }
        self.seen = Observables(self.model, self.data, groups)
        if changes:
            self.seen.modify("x", **changes)
        self.start()

    def start(self, seed=0):
        mujoco.mj_resetData(self.model, self.data)
        self.data.qvel[0] = 1.0
        mujoco.mj_forward(self.model, self.data)
        self.seen.start(np.random.default_rng(seed))

    def step(self, count=1):
        found = []
        for _ in range(count):
            for _ in range(STEPS):
                mujoco.mj_step(self.model, self.data)
                self.seen.sample()
            self.seen.update()
            found.append(self.seen.buffer.observation()["x"].item())
        return np.array(found)


def test_what_is_not_changed_is_the_truth_and_needs_no_sample_of_each_step():
    slide = Slide()
    assert not slide.seen.follows_physics
    assert Slide(delay=0.1).seen.follows_physics
    assert_allclose(slide.step(3), [0.05, 0.10, 0.15], atol=1e-12)


@pytest.mark.parametrize("delay", [0.0, 0.002, 0.04, 0.13])
def test_a_delay_shows_what_was_then(delay):
    found = Slide(delay=delay).step(6)
    assert_allclose(found, np.maximum(0.05 * np.arange(1, 7) - delay, 0.0), atol=1e-9)


def test_a_sampling_rate_holds_values_between_samples():
    found = Slide(sampling_rate=12.5).step(8)  # every 80 ms
    expected = 0.08 * np.floor(0.05 * np.arange(1, 9) / 0.08 + 1e-9)
    assert_allclose(found, expected, atol=1e-9)


@pytest.mark.slow
def test_noise_has_its_size_and_follows_the_seed():
    slide = Slide(noise=GaussianNoise(0.01, bias=0.5), sampling_rate=20)
    first = slide.step(400)
    errors = first - 0.05 * np.arange(1, 401)
    assert errors.mean() == pytest.approx(0.5, abs=0.002)
    assert errors.std() == pytest.approx(0.01, rel=0.1)
    np.random.seed(9)  # noqa: NPY002 - somebody else's, which must not matter
    slide.start()
    assert_array_equal(slide.step(400), first)
    slide.start(seed=1)
    assert not np.array_equal(slide.step(400), first)


def test_the_group_and_the_key_tell_the_same():
    slide = Slide(noise=UniformNoise(0.1))
    for _ in range(5):
        slide.step()
        seen = slide.seen.buffer.observation()
        assert_array_equal(seen["all"], [*seen["x"], *seen["y"]])


def test_random_delays_never_show_something_older_than_before():
    found = Slide(delay=UniformDelay(0.0, 0.2)).step(60)
    ages = 0.05 * np.arange(1, 61) - found
    assert np.diff(found).min() >= 0.0
    assert ages.min() >= 0.0
    assert ages.max() <= 0.2 + 1e-9
    assert np.ptp(ages) > 0.02


def test_filters_smooth_and_forget_at_a_reset():
    average = Slide(filter=MovingAverage(4), sampling_rate=20).step(10)
    assert_allclose(average[4:], 0.05 * np.arange(5, 11) - 0.075, atol=1e-9)
    low = Slide(filter=LowPass(0.5), sampling_rate=20)
    first = low.step(5)
    assert first[1] == pytest.approx(0.5 * (0.5 * 0.05) + 0.05, abs=1e-9)
    low.start()
    assert_array_equal(low.step(5), first)


def test_another_filter_takes_the_place_of_the_first():
    slide = Slide(filter=LowPass(0.99), sampling_rate=20)
    slide.step(5)
    slide.seen.modify("x", filter=LowPass(0.0))
    assert_allclose(slide.step(), 0.30, atol=1e-9)
    slide.seen.modify("x", delay=0.0)  # another change keeps the filter
    assert_allclose(slide.step(), 0.35, atol=1e-9)


def test_changes_at_run_time_begin_at_once_and_end():
    slide = Slide()
    slide.step()
    slide.seen.modify("x", enabled=False)
    assert_allclose(slide.step(2), [0.05, 0.05], atol=1e-12)
    slide.seen.modify("x", enabled=True)
    assert slide.seen.changes == {}
    assert_allclose(slide.step(), 0.20, atol=1e-12)


def test_keys_come_and_go_with_their_space():
    slide = Slide()
    slide.seen.add(
        "twice",
        lambda model, data: reading.computed(1, lambda: 2.0 * data.qpos[:1]),
        group="all",
        delay=0.05,
    )
    slide.seen.modify("y", active=False)
    slide.step(2)
    seen = slide.seen.buffer.observation()
    assert list(seen) == ["x", "twice", "all"]
    assert_allclose(seen["all"], [0.10, 0.10], atol=1e-9)
    assert slide.seen.buffer.space.contains(seen)
    assert slide.seen.names == ("x", "y", "twice")
    slide.seen.modify("y", active=True)
    assert slide.seen.buffer.space["all"].shape == (3,)


def test_noise_stays_within_the_declared_bounds():
    slide = Slide(noise=GaussianNoise(1e6))
    slide.step()
    assert slide.seen.buffer.space.contains(slide.seen.buffer.observation())


def test_wrong_changes_are_named_and_change_nothing():
    slide = Slide()
    with pytest.raises(UnknownNameError, match="No observation named 'z'"):
        slide.seen.modify("z", delay=0.1)
    with pytest.raises(UnknownNameError, match="Did you mean 'noise'"):
        slide.seen.modify("x", nois=None)
    with pytest.raises(ConfigError, match="delay is -1"):
        slide.seen.modify("x", delay=-1)
    with pytest.raises(ConfigError, match="sampling_rate"):
        slide.seen.modify("x", sampling_rate=0)
    with pytest.raises(ConfigError, match="noise must be a function"):
        slide.seen.modify("x", noise=0.1)
    with pytest.raises(ConfigError, match="already"):
        slide.seen.add("x", lambda m, d: reading.joint_positions([0]), group="all")
    assert slide.seen.changes == {}


def test_samples_that_are_lost_leave_the_value_before():
    kept, lost = Slide(dropout=0.5).step(40), Slide(dropout=1.0).step(3)
    assert_array_equal(lost, 0.0)
    late = 0.05 * np.arange(1, 41) - kept
    assert 0.0 < late.max() < 0.03  # a few of the 25 samples of a period
    with pytest.raises(ConfigError, match="dropout"):
        Slide(dropout=1.5)


def test_values_have_no_crop():
    with pytest.raises(ConfigError, match="'x' is no picture"):
        Slide(crop=(2, 2))
