import numpy as np
import pytest

from wbc_suite.planning import (
    ProfileGenerator,
    Segment,
    Trajectory,
    shorten_path,
    shorten_trajectory,
)

SPEED, RATE = np.ones(2), np.full(2, 4.0)
GENERATOR = ProfileGenerator(speed=SPEED, acceleration=RATE)


def line(a, b):
    return Segment.whole(GENERATOR.line(np.array(a), np.array(b)))


def detour():
    """Return a trajectory from (0, 0) to (1, 0) by way of (0.5, 2)."""
    return Trajectory([line((0.0, 0.0), (0.5, 2.0)), line((0.5, 2.0), (1.0, 0.0))])


def shorten(motion, clearance, *, begin=0.0, attempts=300):
    for _ in shorten_trajectory(
        motion,
        GENERATOR,
        attempts=attempts,
        spacing=0.02,
        clearance=clearance,
        min_clearance=0.0,
        begin=lambda: begin,
        rng=np.random.default_rng(0),
    ):
        pass


def test_a_path_is_straightened_where_it_is_free():
    path = [np.array(p) for p in ((0.0, 0.0), (0.5, 2.0), (1.0, 0.0))]
    found = list(
        shorten_path(
            path,
            attempts=100,
            speed=SPEED,
            is_free=lambda a, b: True,
            rng=np.random.default_rng(0),
        )
    )
    assert len(found) == 101
    assert found[:-1] == [None] * 100
    short = found[-1]
    np.testing.assert_array_equal(short[0], path[0])
    np.testing.assert_array_equal(short[-1], path[-1])
    assert max(abs(q[1]) for q in short) < 0.1


def test_a_path_stays_where_nothing_else_is_free():
    path = [np.array(p) for p in ((0.0, 0.0), (0.5, 2.0), (1.0, 0.0))]
    *_, last = shorten_path(
        path,
        attempts=50,
        speed=SPEED,
        is_free=lambda a, b: False,
        rng=np.random.default_rng(0),
    )
    np.testing.assert_array_equal(last, path)


def test_a_segment_reversed_leads_back_the_same_way():
    there = line((0.0, 0.0), (0.5, 2.0)).between(0.2, 1.7)
    back = there.reversed
    assert back.duration == there.duration == pytest.approx(1.5)
    for time in np.linspace(0.0, 1.5, 7):
        x, v = there.state(time)
        x_back, v_back = back.state(1.5 - time)
        np.testing.assert_allclose(x_back, x, atol=1e-12)
        np.testing.assert_allclose(v_back, -v, atol=1e-12)
    part = back.between(0.5, 9.0)
    assert part.duration == pytest.approx(1.0)
    np.testing.assert_allclose(part.state(0.0)[0], back.state(0.5)[0], atol=1e-12)


def test_positions_to_check_are_inside_and_coarse_first():
    segment = line((0.0, 0.0), (1.0, 0.0))
    found = np.array(list(segment.check_positions(0.02)))[:, 0]
    expected = sorted(segment.state(time)[0][0] for time in segment.check_times(0.02))
    np.testing.assert_allclose(sorted(found), expected)
    assert np.diff(expected).max() <= 0.02 * SPEED[0] + 1e-9
    assert abs(found[0] - 0.5) < 0.2  # the middle comes first
    later = list(segment.check_positions(0.02, begin=0.8))
    assert 0 < len(later) < len(found)


def places(motion):
    times = np.linspace(0.0, motion.duration, 500)
    return np.array([motion.state(time)[0] for time in times])


def test_a_detour_in_free_space_is_cut():
    motion = detour()
    shorten(motion, lambda x: 1.0)
    assert motion.duration < 1.3  # straight from rest to rest it is 1.25 s
    np.testing.assert_allclose(motion.end, [1.0, 0.0], atol=1e-6)


def test_a_detour_around_an_obstacle_stays_outside():
    def clearance(x):
        return float(np.hypot(x[0] - 0.5, x[1]) - 0.4)

    motion = detour()
    before = motion.duration
    shorten(motion, clearance)
    assert motion.duration < 0.6 * before
    # Looked at every 20 ms, that is every 2 cm at most.
    assert min(clearance(x) for x in places(motion)) > -1e-3


def test_a_shortened_trajectory_keeps_its_limits():
    motion = detour()
    shorten(motion, lambda x: 1.0, attempts=20)
    times = np.linspace(0.0, motion.duration, 2000)
    states = [motion.state(time) for time in times]
    x, v = (np.array(a) for a in zip(*states, strict=True))
    dt = times[1]
    assert np.abs(np.diff(x, axis=0)).max() <= dt * SPEED[0] * (1.0 + 1e-6)
    assert np.abs(np.diff(v, axis=0)).max() <= dt * RATE[0] * (1.0 + 1e-6)


def test_the_past_of_a_trajectory_does_not_change():
    motion, known = detour(), detour()
    shorten(motion, lambda x: 1.0, begin=1.0)
    assert motion.duration < known.duration
    for time in np.linspace(0.0, 1.0, 11):
        np.testing.assert_allclose(motion.state(time)[0], known.state(time)[0])


def test_a_new_start_leads_to_the_old_end():
    motion = detour()
    x, v = motion.state(3.0)
    ramp = line(x - 0.1, x)
    left = motion.duration - 3.0
    motion.replace(0.0, ramp, 3.0)
    np.testing.assert_allclose(motion.duration, ramp.duration + left)
    np.testing.assert_allclose(motion.state(ramp.duration + 1e-9)[1], v, atol=1e-6)
    np.testing.assert_allclose(motion.end, [1.0, 0.0], atol=1e-9)
