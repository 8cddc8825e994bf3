"""The base's state from an IMU and standing feet, against motions that are known."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.locomotion.base_estimator import (
    EstimatorNoise,
    begin_estimate,
    correct,
    make_base_estimate,
    propagate,
)

GRAVITY = np.array([0.0, 0.0, -9.81])
DT = 0.002
FEET = np.array([[0.3, 0.2, 0.0], [0.3, -0.2, 0.0], [-0.3, 0.2, 0.0], [-0.3, -0.2, 0]])


class Body:
    """A body that sways over four feet, integrated as MuJoCo integrates."""

    def __init__(self, seed=0):
        self.rng = np.random.default_rng(seed)
        self.p, self.v, self.R, self.t = (
            np.array([0.0, 0, 0.5]),
            np.zeros(3),
            np.eye(3),
            0,
        )
        self.w = np.zeros(3)

    def step(self):
        """Advance; return specific force and angular velocity of the step."""
        t = self.t = self.t + DT
        a = np.array([np.sin(5 * t), 0.7 * np.cos(4 * t), 0.5 * np.sin(7 * t)])
        self.w += DT * np.array([np.cos(3 * t), -np.sin(4 * t), 0.3 * np.cos(2 * t)])
        force = self.R.T @ (a - GRAVITY)
        self.v = self.v + DT * a
        self.p = self.p + DT * self.v
        self.R = self.R @ pin.exp3(DT * self.w)
        return force, self.w.copy()

    def feet(self):
        return (FEET - self.p) @ self.R


def run(body, estimate, seconds, *, bias=0.0, noise=0.0, stands=None):
    rng, errors = np.random.default_rng(1), []
    for k in range(round(seconds / DT)):
        force, rate = body.step()
        force = force + bias + noise * rng.normal(size=3)
        rate = rate + 0.05 * (bias + noise * rng.normal(size=3))
        propagate(estimate, force, rate, GRAVITY, DT)
        on = np.ones(4, dtype=np.int64) if stands is None else stands(k)
        correct(estimate, body.feet(), on, DT)
        errors.append(
            [
                np.linalg.norm(estimate.p - body.p),
                np.linalg.norm(estimate.v - body.v),
                np.linalg.norm(pin.log3(estimate.R.T @ body.R)),
            ]
        )
    return np.array(errors)


def started(body):
    estimate = make_base_estimate(4, EstimatorNoise())
    begin_estimate(estimate, body.p, body.R, body.v)
    return estimate


def test_a_filter_begins_anew_at_a_pose_without_knowledge_of_feet():
    body = Body()
    estimate, fresh = started(body), started(body)
    run(body, estimate, 0.1, noise=0.1)
    begin_estimate(estimate, fresh.p, fresh.R, fresh.v)
    for name in ("p", "v", "R", "acceleration_bias", "gyro_bias", "standing", "P"):
        np.testing.assert_array_equal(getattr(estimate, name), getattr(fresh, name))
    sizes = np.repeat([0.01, 0.1, 0.01, 0.05, 0.005, 0.0, 0.0, 0.0, 0.0], 3)
    np.testing.assert_allclose(fresh.P, np.diag(sizes**2), atol=1e-12)
    np.testing.assert_array_equal(fresh.standing, -1.0)


def test_the_covariance_follows_its_transition_and_the_noise():
    """P' = F P F^T + Q, with the noise of the IMU and of slipping feet."""
    body, dt = Body(), 0.01
    estimate = started(body)
    run(body, estimate, 0.1)
    before, noise = estimate.P.copy(), np.array(EstimatorNoise())
    propagate(estimate, *body.step(), GRAVITY, dt)
    F = estimate.F
    spread = [0.0, noise[0], noise[1], noise[2], noise[3], *[noise[4]] * 4]
    Q = dt * np.diag(np.repeat(spread, 3) ** 2)
    np.testing.assert_allclose(estimate.P, F @ before @ F.T + Q, rtol=1e-9, atol=1e-15)


def test_an_exact_imu_is_integrated_exactly():
    body = Body()
    estimate = started(body)
    none = np.zeros(4, dtype=np.int64)
    errors = run(body, estimate, 1.0, stands=lambda k: none)
    assert errors.max() < 1e-10


def test_standing_feet_hold_the_estimate_of_a_noisy_imu():
    body = Body()
    errors = run(body, started(body), 5.0, noise=0.2)
    assert errors[500:].max(axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=0.03)


def test_biases_are_found():
    body = Body()
    estimate = started(body)
    errors = run(body, estimate, 20.0, bias=0.1)
    # Horizontal bias and tilt are told apart by turning only.
    assert estimate.gyro_bias == pytest.approx(0.005 * np.ones(3), abs=0.002)
    assert errors[-1, 1] < 0.02
    assert errors[-1, 0] < 0.05


def test_feet_that_step_keep_the_estimate():
    body = Body()

    def trot(k):
        phase = (k * DT) % 0.5 < 0.25
        return np.array([phase, not phase, not phase, phase], dtype=np.int64)

    errors = run(body, started(body), 5.0, noise=0.1, stands=trot)
    assert errors[:, 1].max() < 0.05
    assert errors[:, 0].max() < 0.05


def test_a_foot_that_slips_is_estimated_anew():
    body = Body()
    estimate = started(body)
    run(body, estimate, 1.0)
    before = estimate.p - body.p
    moved = body.feet() + np.outer([1, 0, 0, 0], [0.2, 0, 0]) @ body.R
    correct(estimate, moved, np.ones(4, dtype=np.int64), DT)
    assert estimate.p - body.p == pytest.approx(before, abs=1e-3)
    assert estimate.feet[0, 0] == pytest.approx(0.5, abs=0.02)


def test_the_covariance_stays_symmetric_and_positive():
    body = Body()
    estimate = started(body)
    run(body, estimate, 2.0, noise=0.1)
    assert np.abs(estimate.P - estimate.P.T).max() < 1e-12
    assert np.linalg.eigvalsh(estimate.P).min() > -1e-9


def test_the_jacobian_of_a_foot_is_that_of_finite_differences():
    body = Body()
    estimate = started(body)
    run(body, estimate, 0.5)
    h, k = 1e-6, 2
    correct(estimate, body.feet(), np.array([0, 0, 1, 0]), DT)
    H = estimate.H.copy()

    def foot(dp, dturn, df):
        R = estimate.R @ pin.exp3(dturn)
        return R.T @ (estimate.feet[k] + df - estimate.p - dp)

    u = foot(np.zeros(3), np.zeros(3), np.zeros(3))
    for column, part in ((0, 0), (6, 1), (15 + 3 * k, 2)):
        for i in range(3):
            steps = [np.zeros(3) for _ in range(3)]
            steps[part][i] = h
            expected = (foot(*steps) - u) / h
            assert H[:, column + i] == pytest.approx(expected, abs=1e-4)
