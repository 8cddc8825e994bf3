import numpy as np
import pytest

from wbc_suite.planning import ProfileGenerator, retrace_scales

JOINTS = 5
DT = 0.05
SPEED, ACCELERATION = np.full(3, 2.0), np.full(3, 8.0)


def generator(speed, acceleration):
    return ProfileGenerator(speed=np.array(speed), acceleration=np.array(acceleration))


def state(profile, time):
    x, v, _ = profile.at_time(time)
    return np.array(x), np.array(v)


def random_state(rng, speed):
    return rng.normal(size=JOINTS), rng.uniform(-1.0, 1.0, JOINTS) * speed


@pytest.mark.slow
def test_profiles_lead_from_state_to_state_within_limits():
    rng = np.random.default_rng(0)
    for _ in range(300):
        speed, rate = rng.uniform(0.5, 3.0, JOINTS), rng.uniform(1.0, 20.0, JOINTS)
        ends = random_state(rng, speed), random_state(rng, speed)
        profile = generator(speed, rate).between(*ends)
        assert profile is not None
        for (x, v), time in zip(ends, (0.0, profile.duration), strict=True):
            np.testing.assert_allclose(state(profile, time)[0], x, atol=1e-6)
            np.testing.assert_allclose(state(profile, time)[1], v, atol=1e-6)
        times = np.linspace(0.0, profile.duration, 200)
        states = [state(profile, time) for time in times]
        x, v = (np.array(a) for a in zip(*states, strict=True))
        dt = times[1]
        assert (np.abs(v) <= speed + 1e-6).all()
        assert (np.abs(np.diff(v, axis=0)) <= rate * dt * (1.0 + 1e-6)).all()
        # Velocities are the positions' own: the trapezoid errs by a corner in a step.
        step = 0.5 * (v[1:] + v[:-1]) * dt
        assert (np.abs(np.diff(x, axis=0) - step) <= 0.5 * rate * dt**2 + 1e-9).all()


def test_the_slowest_joint_moves_as_fast_as_it_can():
    still, step = np.zeros(2), np.array([2.0, 0.1])
    profile = generator([1.0, 1.0], [4.0, 4.0]).between((still, still), (step, still))
    # d / v + v / a, from rest to rest at full speed.
    assert profile.duration == pytest.approx(2.0 + 0.25)


def test_a_joint_that_moves_away_brakes_and_comes_back():
    zero, away = np.zeros(1), np.ones(1)
    profile = generator([1.0], [2.0]).between((zero, away), (zero, zero))
    # 0.25 m away in 0.5 s; back from rest to rest takes 2 sqrt(d / a).
    assert profile.duration == pytest.approx(0.5 + 2.0 * np.sqrt(0.25 / 2.0))


def test_a_profile_takes_its_least_duration():
    zero, one = np.zeros(1), np.ones(1)
    profile = generator([1.0], [8.0]).between(
        (zero, zero), (one, zero), min_duration=3.0
    )
    assert profile.duration == pytest.approx(3.0)
    np.testing.assert_allclose(state(profile, 3.0)[0], one, atol=1e-6)


def test_a_state_that_is_not_finite_has_no_profile():
    zero = np.zeros(2)
    broken = np.array([0.0, np.nan])
    make = generator([1.0, 1.0], [1.0, 1.0])
    assert make.between((broken, zero), (zero, zero)) is None
    assert make.between((zero, zero), (zero, zero)) is not None


def test_an_end_faster_than_the_limit_raises_it():
    zero, fast = np.zeros(1), np.array([1.5])
    profile = generator([1.0], [2.0]).between((zero, zero), (np.ones(1), fast))
    np.testing.assert_allclose(state(profile, profile.duration)[1], fast, atol=1e-9)


def test_lines_are_straight():
    start, end = np.array([0.0, 1.0, 2.0]), np.array([1.0, 1.0, -2.0])
    profile = generator(np.ones(3), np.full(3, 4.0)).line(start, end)
    for time in np.linspace(0.0, profile.duration, 20):
        x, v = state(profile, time)
        np.testing.assert_allclose(x[2], 2.0 - 4.0 * x[0], atol=1e-9)
        assert (np.abs(v) <= 1.0 + 1e-9).all()
    np.testing.assert_allclose(state(profile, profile.duration)[0], end, atol=1e-9)
    assert profile.duration == pytest.approx(4.0 + 0.25)


def test_stopping_stops_each_joint_as_soon_as_it_can():
    v = np.array([1.0, -0.5, 0.0])
    profile = generator(np.ones(3), [2.0, 1.0, 1.0]).stop((np.zeros(3), v))
    x_rest, v_rest = state(profile, profile.duration)
    assert profile.duration == pytest.approx(0.5)
    np.testing.assert_allclose(x_rest, [0.25, -0.125, 0.0], atol=1e-12)
    np.testing.assert_allclose(v_rest, 0.0, atol=1e-12)


def scales_of(v):
    steps = np.full(len(v) - 1, DT)
    return retrace_scales(v, steps, speed=SPEED, acceleration=ACCELERATION)


def creeping():
    """Return velocities, last first, of a slow approach to an obstacle."""
    return np.outer(0.02 * 1.5 ** np.arange(12), [1.0, -0.5, 0.2])


def test_a_slow_approach_is_retraced_faster():
    v = creeping()
    found = scales_of(v)
    before = DT * (len(v) - 1)
    after = (2.0 * DT / (found[1:] + found[:-1])).sum()
    assert found[0] == 1.0
    # From rest at full acceleration, over the distance of the slowest joint.
    distance = 0.5 * DT * np.abs(v[1:] + v[:-1]).sum(axis=0).max()
    least = np.sqrt(2.0 * distance / ACCELERATION[0])
    assert least <= after < 1.6 * least < 0.9 * before


def test_scales_keep_speeds_and_accelerations():
    rng = np.random.default_rng(0)
    for _ in range(50):
        # A motion without jumps: 0.3 of the accelerations in each step.
        v = np.cumsum(rng.uniform(-0.3, 0.3, (20, 3)) * ACCELERATION * DT, axis=0)
        v = np.clip(v, -SPEED, SPEED)
        found = scales_of(v)
        scaled = found[:, None] * v
        assert (found >= 1.0).all()
        assert (np.abs(scaled) <= SPEED + 1e-9).all()
        step = 2.0 * DT / (found[1:] + found[:-1])
        assert (
            np.abs(np.diff(scaled, axis=0)) <= step[:, None] * ACCELERATION + 1e-9
        ).all()


def test_a_trail_at_its_limits_is_retraced_at_its_own_speed():
    v = np.outer(ACCELERATION[0] * DT * np.arange(6), np.ones(3))
    np.testing.assert_allclose(scales_of(np.minimum(v, 2.0)), 1.0)
    jump = np.array([[0.0] * 3, [1.5] * 3, [-1.5] * 3])  # more than they can
    np.testing.assert_allclose(scales_of(jump), 1.0)
