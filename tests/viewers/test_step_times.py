"""Times of steps on a clock: their own duration, their period, and ages of inputs."""

import numpy as np
import pytest

from wbc_suite.viewers.loop_timing import StepTimes


def test_duration_is_that_of_the_step_and_not_its_period():
    times = StepTimes()
    assert np.isnan([times.duration, times.period, times.latency]).all()
    for k in range(5):
        times.end_step([], 0.010 * k, 0.010 * k + 0.002)
    assert times.duration == pytest.approx(0.002)
    assert times.period == pytest.approx(0.010)


def test_time_of_a_reset_belongs_to_no_period():
    times = StepTimes()
    times.end_step([], 0.000, 0.002)
    times.end_step([], 0.010, 0.012)
    times.restart()
    times.end_step([], 7.000, 7.002)
    assert times.period == pytest.approx(0.010)


def test_inputs_are_as_old_as_at_the_end_of_their_step():
    times = StepTimes()
    times.end_step([0.001, 0.004, 9.0], 0.005, 0.007)
    np.testing.assert_allclose(times.latencies, [0.006, 0.003, 0.0])
    assert times.latency == pytest.approx(0.003)
