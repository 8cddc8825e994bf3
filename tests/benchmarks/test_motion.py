"""The judges of motions find what closed forms say of a second-order response."""

import numpy as np
import pytest
from harness.motion import (
    DIRECTIONS,
    RATE,
    circle,
    circle_motion,
    judge_circle,
    judge_step,
    step_motion,
)

DT = 2e-3
TIMES = DT * np.arange(1, 1001)


def response(damping_ratio):
    """Return the unit step response of `e'' + 2 z w e' + w^2 e = 0`, w^2 = 150."""
    w, z = np.sqrt(150.0), damping_ratio
    if z == 1.0:
        return 1.0 - (1.0 + w * TIMES) * np.exp(-w * TIMES)
    d = w * np.sqrt(1.0 - z * z)
    wave = np.cos(d * TIMES) + z * w / d * np.sin(d * TIMES)
    return 1.0 - np.exp(-z * w * TIMES) * wave


def test_critical_damping_settles_without_overshoot():
    goals = step_motion(0)
    judged = judge_step(goals, np.outer(response(1.0), goals[0]), DT)
    # (1 + x) exp(-x) = 0.02 at x = 5.8339
    assert judged["settling_s"] == pytest.approx(5.8339 / np.sqrt(150.0), abs=2 * DT)
    assert judged["overshoot"] == 0.0
    assert judged["error_mm"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("direction", range(6))
def test_overshoot_is_what_the_damping_ratio_says(direction):
    goals = step_motion(direction)
    judged = judge_step(goals, np.outer(response(0.5), goals[0]), DT)
    expected = np.exp(-np.pi * 0.5 / np.sqrt(0.75))
    assert judged["overshoot"] == pytest.approx(expected, rel=1e-3)


def test_an_error_that_stays_is_seen_and_never_settles():
    goals = step_motion(1)
    found = np.outer(response(1.0), goals[0])
    found[:, 0] += 0.002
    judged = judge_step(goals, found, DT)
    assert judged["settling_s"] is None
    assert judged["error_mm"] == pytest.approx(2.0, abs=1e-3)
    assert judged["error_deg"] == pytest.approx(0.0, abs=1e-5)


def test_steps_are_5_cm_and_20_degrees_about_another_axis():
    for direction in range(6):
        goal = step_motion(direction)[-1]
        assert goal[:3] == pytest.approx(0.05 * DIRECTIONS[direction])
        assert np.linalg.norm(goal[3:]) == pytest.approx(np.deg2rad(20.0))
        assert goal[:3] @ goal[3:] == 0.0


def test_a_late_hand_is_as_far_off_as_the_chord_is_long():
    times, lag = DT * np.arange(1, 2001), 0.05
    judged = judge_circle(circle(times - lag), DT)
    chord = 2e3 * 0.10 * np.sin(np.pi * 0.25 * lag)
    assert judged["worst_mm"] == pytest.approx(chord, rel=1e-9)
    assert judged["median_mm"] == pytest.approx(chord, rel=1e-9)


def test_the_circle_is_20_cm_across_once_in_4_s_and_closes():
    goals = circle_motion()
    assert len(goals) == 4 * RATE
    assert np.ptp(goals[:, 1]) == pytest.approx(0.20)
    assert np.ptp(goals[:, 2]) == pytest.approx(0.20)
    assert goals[-1] == pytest.approx(0.0, abs=1e-12)
