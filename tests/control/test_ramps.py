import numpy as np
import pytest

from wbc_suite.control.composite.ramps import (
    braking_ramp,
    fastest_ramp,
    line_ramp,
    reversed_ramp,
)

JOINTS = 5


def random_state(rng, speed):
    return rng.normal(size=JOINTS), rng.uniform(-1.0, 1.0, JOINTS) * speed


def random_ramps(count):
    """Yield ramps between random states of motion, with their ends and limits."""
    rng = np.random.default_rng(0)
    for _ in range(count):
        speed, rate = rng.uniform(0.5, 3.0, JOINTS), rng.uniform(1.0, 20.0, JOINTS)
        ends = random_state(rng, speed), random_state(rng, speed)
        yield fastest_ramp(*ends, speed=speed, rate=rate), ends, speed, rate


@pytest.mark.slow
def test_ramps_lead_from_state_to_state_within_limits():
    found = 0
    for ramp, (start, end), speed, rate in random_ramps(300):
        if ramp is None:
            continue
        found += 1
        for (x, v), time in ((start, 0.0), (end, ramp.duration)):
            np.testing.assert_allclose(ramp.state(time)[0], x, atol=1e-6)
            np.testing.assert_allclose(ramp.state(time)[1], v, atol=1e-6)
        times = np.linspace(0.0, ramp.duration, 200)
        x, v = (np.array(a) for a in zip(*map(ramp.state, times), strict=True))
        dt = times[1]
        assert (np.abs(v) <= speed + 1e-6).all()
        assert (np.abs(np.diff(v, axis=0)) <= rate * dt * (1.0 + 1e-6)).all()
        # Velocities are the positions' own: the trapezoid errs by a corner in a step.
        step = 0.5 * (v[1:] + v[:-1]) * dt
        assert (np.abs(np.diff(x, axis=0) - step) <= 0.5 * rate * dt**2).all()
    assert found > 280  # the others would have to turn round to take so long


def test_the_slowest_joint_moves_as_fast_as_it_can():
    still, step = np.zeros(2), np.array([2.0, 0.1])
    limits = {"speed": np.ones(2), "rate": np.full(2, 4.0)}
    ramp = fastest_ramp((still, still), (step, still), **limits)
    assert ramp is not None
    # d / v + v / a, from rest to rest at full speed.
    assert ramp.duration == pytest.approx(2.0 + 0.25)


def test_a_joint_that_moves_away_brakes_and_comes_back():
    zero, away = np.zeros(1), np.ones(1)
    limits = {"speed": np.ones(1), "rate": np.full(1, 2.0)}
    ramp = fastest_ramp((zero, away), (zero, zero), **limits)
    assert ramp is not None
    # 0.25 m away in 0.5 s; back from rest to rest takes 2 sqrt(d / a).
    assert ramp.duration == pytest.approx(0.5 + 2.0 * np.sqrt(0.25 / 2.0))


def test_a_ramp_takes_as_long_as_it_is_told_to():
    zero, one = np.zeros(1), np.ones(1)
    limits = {"speed": one, "rate": 8.0 * one}
    ramp = fastest_ramp((zero, zero), (one, zero), least=3.0, **limits)
    assert ramp is not None
    assert ramp.duration == pytest.approx(3.0)
    np.testing.assert_allclose(ramp.state(3.0)[0], one, atol=1e-6)


def test_line_ramps_stay_on_the_line():
    start, end = np.array([0.0, 1.0, 2.0]), np.array([1.0, 1.0, -2.0])
    ramp = line_ramp(start, end, speed=np.ones(3), rate=np.full(3, 4.0))
    for time in np.linspace(0.0, ramp.duration, 20):
        x, v = ramp.state(time)
        np.testing.assert_allclose(x[2], 2.0 - 4.0 * x[0], atol=1e-9)
        assert (np.abs(v) <= 1.0 + 1e-9).all()
    np.testing.assert_allclose(ramp.state(ramp.duration)[0], end, atol=1e-9)
    assert ramp.duration == pytest.approx(4.0 + 0.25)


def test_braking_stops_each_joint_and_back_is_the_same_way():
    v = np.array([1.0, -0.5, 0.0])
    ramp = braking_ramp((np.zeros(3), v), rate=np.array([2.0, 1.0, 1.0]))
    back = reversed_ramp(ramp)
    x_rest, v_rest = ramp.state(ramp.duration)
    np.testing.assert_allclose(x_rest, [0.25, -0.125, 0.0])
    np.testing.assert_allclose(v_rest, 0.0)
    for time in np.linspace(0.0, ramp.duration, 11):
        forth, reverse = ramp.state(time), back.state(ramp.duration - time)
        np.testing.assert_allclose(reverse[0], forth[0], atol=1e-12)
        np.testing.assert_allclose(reverse[1], -forth[1], atol=1e-12)
