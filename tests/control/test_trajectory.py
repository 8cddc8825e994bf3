import itertools

import numpy as np

from wbc_suite.control.composite.ramps import line_ramp
from wbc_suite.control.composite.trajectory import Trajectory

SPEED, RATE = np.ones(2), np.full(2, 4.0)


def detour():
    """Return a motion from (0, 0) to (1, 0) by way of (0.5, 2)."""
    places = [np.array(p) for p in ((0.0, 0.0), (0.5, 2.0), (1.0, 0.0))]
    first, last = (
        line_ramp(a, b, speed=SPEED, rate=RATE) for a, b in itertools.pairwise(places)
    )
    motion = Trajectory(first, speed=SPEED, rate=RATE)
    motion.extend([last])
    return motion


def shorten(motion, room, *, begin=0.0, tries=300):
    for _ in motion.shorten(
        tries,
        room=room,
        enough=0.0,
        begin=lambda: begin,
        rng=np.random.default_rng(0),
    ):
        pass


def places(motion):
    times = np.linspace(0.0, motion.duration, 500)
    return np.array([motion.state(time)[0] for time in times])


def test_a_detour_without_reason_is_cut():
    motion = detour()
    shorten(motion, lambda x: 1.0)
    assert motion.duration < 1.3  # straight from rest to rest it is 1.25 s
    np.testing.assert_allclose(motion.end, [1.0, 0.0], atol=1e-6)


def test_a_detour_with_a_reason_stays_outside():
    def room(x):
        return float(np.hypot(x[0] - 0.5, x[1]) - 0.4)

    motion = detour()
    before = motion.duration
    shorten(motion, room)
    assert motion.duration < 0.6 * before
    # Looked at every 20 ms, that is every 2 cm at most.
    assert min(room(x) for x in places(motion)) > -1e-3


def test_the_motion_has_no_steps():
    motion = detour()
    shorten(motion, lambda x: 1.0, tries=20)
    times = np.linspace(0.0, motion.duration, 2000)
    states = [motion.state(time) for time in times]
    x, v = (np.array(a) for a in zip(*states, strict=True))
    dt = times[1]
    assert np.abs(np.diff(x, axis=0)).max() <= dt * SPEED[0] * (1.0 + 1e-6)
    assert np.abs(np.diff(v, axis=0)).max() <= dt * RATE[0] * (1.0 + 1e-6)


def test_what_is_past_does_not_change():
    motion, known = detour(), detour()
    shorten(motion, lambda x: 1.0, begin=1.0)
    assert motion.duration < known.duration
    for time in np.linspace(0.0, 1.0, 11):
        np.testing.assert_allclose(motion.state(time)[0], known.state(time)[0])


def test_a_new_beginning_leads_on_to_the_old_end():
    motion = detour()
    x, v = motion.state(3.0)
    ramp = line_ramp(x - 0.1, x, speed=SPEED, rate=RATE)
    left = motion.duration - 3.0
    motion.begin_with(ramp, 3.0)
    np.testing.assert_allclose(motion.duration, ramp.duration + left)
    np.testing.assert_allclose(motion.state(ramp.duration + 1e-9)[1], v, atol=1e-6)
    np.testing.assert_allclose(motion.end, [1.0, 0.0], atol=1e-9)
