import numpy as np

from wbc_suite.control.composite.retrace import paces_back

DT = 0.05
SPEED, RATE = np.full(3, 2.0), np.full(3, 8.0)


def paces(v):
    return paces_back(v, np.full(len(v) - 1, DT), speed=SPEED, rate=RATE)


def creeping():
    """Return velocities, last first, of a robot that crept up to an obstacle."""
    return np.outer(0.02 * 1.5 ** np.arange(12), [1.0, -0.5, 0.2])


def test_nobody_creeps_back():
    v = creeping()
    found = paces(v)
    before = DT * (len(v) - 1)
    after = (2.0 * DT / (found[1:] + found[:-1])).sum()
    assert found[0] == 1.0
    # From rest at full acceleration, over the distance of the slowest joint.
    distance = 0.5 * DT * np.abs(v[1:] + v[:-1]).sum(axis=0).max()
    least = np.sqrt(2.0 * distance / RATE[0])
    assert least <= after < 1.6 * least < 0.9 * before


def test_paces_keep_speeds_and_accelerations():
    rng = np.random.default_rng(0)
    for _ in range(50):
        # A motion without jumps: 0.3 of the accelerations in each step.
        v = np.cumsum(rng.uniform(-0.3, 0.3, (20, 3)) * RATE * DT, axis=0)
        v = np.clip(v, -SPEED, SPEED)
        found = paces(v)
        scaled = found[:, None] * v
        assert (found >= 1.0).all()
        assert (np.abs(scaled) <= SPEED + 1e-9).all()
        step = 2.0 * DT / (found[1:] + found[:-1])
        assert (np.abs(np.diff(scaled, axis=0)) <= step[:, None] * RATE + 1e-9).all()


def test_what_was_done_at_the_limits_is_done_again_as_it_was():
    v = np.outer(RATE[0] * DT * np.arange(6), np.ones(3))
    np.testing.assert_allclose(paces(np.minimum(v, 2.0)), 1.0)
    jump = np.array([[0.0] * 3, [1.5] * 3, [-1.5] * 3])  # more than they can
    np.testing.assert_allclose(paces(jump), 1.0)
