import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.control.part.approach import (
    approach_pose,
    approach_speed,
    travel_time,
)
from wbc_suite.control.part.reference import Reference, mean_over
from wbc_suite.control.part.stance import contact_forces
from wbc_suite.robot import load_robot


def standing():
    """Return the root Jacobian of four point feet and their rows."""
    feet = [[0.3, 0.2, -0.5], [0.3, -0.2, -0.5], [-0.3, 0.2, -0.5], [-0.3, -0.2, -0.5]]
    J = np.concatenate([np.hstack([np.eye(3), -pin.skew(np.array(f))]) for f in feet])
    return J, [slice(3 * k, 3 * k + 3) for k in range(4)]


def test_contact_forces_carry_the_weight_evenly():
    J, rows = standing()
    wrench = np.array([0, 0, 600.0, 0, 0, 0])
    f = contact_forces(J, wrench, weights=np.ones(12), contacts=rows)
    np.testing.assert_allclose(J.T @ f, wrench, atol=1e-9)
    np.testing.assert_allclose(f[2::3], 150.0, atol=1e-9)


def test_contacts_never_pull():
    J, rows = standing()
    tipping = np.array([0, 0, 600.0, 110.0, 0, 0])  # nearly all on two feet
    f = contact_forces(J, tipping, weights=np.ones(12), contacts=rows)
    assert f[2::3].min() >= 0.0
    np.testing.assert_allclose(J.T @ f, tipping, atol=1e-6)
    falling = np.array([0, 0, 600.0, 200.0, 0, 0])  # more than the feet can give
    f = contact_forces(J, falling, weights=np.ones(12), contacts=rows)
    assert f[2::3].min() >= 0.0


def test_approach_never_brakes_harder_than_asked():
    d = np.linspace(1e-6, 2.0, 20000)
    v = approach_speed(d, rate=50.0, speed=np.inf, acceleration=4.0)
    deceleration = v[1:] * np.diff(v) / np.diff(d)
    assert deceleration.max() <= 4.0 + 1e-3
    assert v[0] == pytest.approx(50.0 * d[0], rel=1e-3)


def test_approach_from_far_takes_about_the_time_of_the_parabola():
    now, goal = pin.SE3.Identity(), pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.0]))
    dt, gain, ticks = 0.01, 0.5, 0
    while np.linalg.norm(goal.translation - now.translation) > 1e-3:
        target = approach_pose(
            now, goal, dt=dt, gain=gain, speed=(9.0, 9.0), acceleration=(4.0, 9.0)
        )
        now.translation += gain * (target.translation - now.translation)
        ticks += 1
    assert dt * ticks == pytest.approx(np.sqrt(2 * 0.5 / 4.0), abs=0.1)


def test_travel_time_is_that_of_the_fastest_profile():
    distance, speed, braking = (
        np.array([0.0, 0.5, 3.0]),
        np.full(3, 2.0),
        np.full(3, 4.0),
    )
    times = travel_time(distance, speed=speed, acceleration=braking)
    # Nothing; a triangle that peaks at sqrt(2) m/s; 1 m of ramps and 2 m at 2 m/s.
    np.testing.assert_allclose(times, [0.0, np.sqrt(0.5), 2.0])


def sampled_reference(mean, rates, samples=4):
    """Return solved configurations, then p, v, a of the reference, sampled finely."""
    model = load_robot("Panda").to_pinocchio()
    index = np.arange(3)
    reference = Reference(model, index, index, 0.01, mean=mean)
    q0 = np.zeros(model.nq)
    reference.reset(q0)
    solved, sampled = [q0[:3]], []
    for rate in rates:
        v = np.zeros(model.nv)
        v[:3] = rate
        solved.append(reference.extend(v)[:3])
        p, r, c, j = reference.polynomial()
        for s in np.linspace(0.01 / samples, 0.01, samples):
            a = c + s * j
            sampled.append(
                (p + s * (r + s * (c / 2 + s * j / 6)), r + s * (c + a) / 2, a)
            )
        np.testing.assert_allclose(sampled[-1][0], reference.targets(), atol=1e-15)
    return np.array(solved), np.array(sampled)


@pytest.mark.parametrize("mean", [1, 2, 5])
def test_the_reference_keeps_every_limit_of_what_was_solved(mean):
    rng, dt, most = np.random.default_rng(1), 0.01, 50.0
    changes = rng.choice([-1.0, 1.0], size=(60, 3)) * most * dt  # the worst there is
    rates = np.cumsum(changes, axis=0)
    solved, sampled = sampled_reference(mean, rates)
    position, velocity, acceleration = np.swapaxes(sampled, 0, 1)
    for k in range(len(position)):
        recent = solved[max(0, k // 4 - 1 - mean) : k // 4 + 2]
        assert (position[k] >= recent.min(axis=0) - 1e-12).all()
        assert (position[k] <= recent.max(axis=0) + 1e-12).all()
    assert (np.abs(velocity).max(axis=0) <= np.abs(rates).max(axis=0) + 1e-9).all()
    assert np.abs(acceleration).max() <= most * (1.0 + 1e-9)
    steps, spans = np.diff(sampled, axis=0), 0.0025
    np.testing.assert_allclose(
        steps[:, 0] / spans, (velocity[1:] + velocity[:-1]) / 2, atol=6e-3
    )
    np.testing.assert_allclose(
        steps[:, 1] / spans, (acceleration[1:] + acceleration[:-1]) / 2, atol=1e-8
    )
    jerk = np.abs(steps[:, 2]).max() / spans
    assert jerk <= 2.0 * most / (mean * dt) * (1.0 + 1e-6)
    assert mean_over(most, jerk, dt) <= mean
    assert jerk > most / (mean * dt), "the worst was asked for"


@pytest.mark.parametrize("mean", [1, 3])
def test_the_reference_arrives_where_the_last_solve_was(mean):
    rates = [[0.3, -0.2, 0.1]] * 5 + [[0.0] * 3] * (mean + 2)
    solved, sampled = sampled_reference(mean, rates)
    np.testing.assert_allclose(
        sampled[-1], [solved[-1], np.zeros(3), np.zeros(3)], atol=1e-12
    )


def test_a_mean_of_turned_roots_is_a_turn_and_arrives():
    model = load_robot("GR1FreeBody").to_pinocchio()
    none = np.zeros(0, dtype=np.int64)
    reference = Reference(model, none, none, 0.01, mean=3)
    rng, q = np.random.default_rng(2), pin.neutral(model)
    reference.reset(q)
    for _ in range(8):
        q = reference.extend(rng.normal(size=model.nv))
        turn = reference.root_motion().start.rotation
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    for _ in range(5):
        reference.extend(np.zeros(model.nv))
    motion = reference.root_motion()
    assert motion.start.isApprox(pin.XYZQUATToSE3(q[:7]), 1e-12)
    assert (
        np.abs(np.concatenate([motion.twist, motion.curve, motion.bend])).max() < 1e-8
    )
