import numpy as np
import pytest

from wbc_suite.planning import ProfileGenerator, Segment, track_waypoints
from wbc_suite.planning.waypoint_tracking import HORIZONS

DT = 0.01
TIMES = np.array([DT, *HORIZONS])


def braking_motion(rate):
    """Return a motion that stops at 1 rad, and takes 0.95 of a rate to do so."""
    start = np.zeros(1), np.array([1.5])
    end = np.ones(1), np.zeros(1)
    limits = {"speed": np.full(1, 1.5), "acceleration": np.full(1, 0.95 * rate)}
    return Segment.whole(ProfileGenerator(**limits).between(start, end))


def track(v, ahead, motion, rate):
    found = np.empty_like(v)
    track_waypoints(v, ahead, motion, TIMES, rate, found)
    return found


def chase(motion, x, v, rate, steps):
    """Return positions and velocities of a joint that tracks the motion."""
    found = []
    for k in range(steps):
        states = [motion.state(k * DT + time) for time in TIMES]
        ahead = np.array([place for place, _ in states]) - x
        speeds = np.array([speed for _, speed in states])
        wanted = track(v, ahead, speeds, np.full(1, rate))
        v = np.clip(wanted, v - rate * DT, v + rate * DT)
        x = x + DT * v
        found.append((x[0], v[0]))
    return np.array(found).T


@pytest.mark.parametrize("behind", [0.01, 0.05, 0.2])
def test_a_joint_that_is_behind_catches_up_and_does_not_shoot_past(behind):
    rate = 4.0
    motion = braking_motion(rate)
    x, _ = chase(motion, np.array([-behind]), np.array([1.5]), rate, 200)
    assert x.max() < 1.0 + 2e-3
    assert x[-1] == pytest.approx(1.0, abs=1e-6)
    # No later than the motion by more than it takes to go the rest on its own.
    arrived = DT * np.flatnonzero(np.abs(x - 1.0) > 1e-3)[-1]
    assert arrived < motion.duration + 2.0 * np.sqrt(behind / rate) + 0.05


def test_a_joint_on_the_motion_stays_on_it():
    rate = 4.0
    motion = braking_motion(rate)
    x, _ = chase(motion, np.zeros(1), np.array([1.5]), rate, 100)
    expected = [motion.state((k + 1) * DT)[0][0] for k in range(100)]
    np.testing.assert_allclose(x, expected, atol=1e-4)


def test_a_joint_far_behind_goes_as_it_can():
    far = np.full((len(TIMES), 2), [5.0, -5.0])
    still = np.zeros_like(far)
    found = track(np.zeros(2), far, still, np.full(2, 3.0))
    # Half of the time to speed up, half to brake.
    np.testing.assert_allclose(found, 0.5 * 3.0 * HORIZONS[-1] * np.array([1.0, -1.0]))
