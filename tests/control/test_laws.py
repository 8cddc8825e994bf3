import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.control.composite.approach import (
    approach_pose,
    approach_speed,
    travel_time,
)
from wbc_suite.control.composite.reference import Reference
from wbc_suite.control.part.joint_position import computed_torque
from wbc_suite.control.part.stance import contact_forces
from wbc_suite.robot import load_robot


def test_computed_torque_is_inverse_dynamics_of_the_wanted_acceleration():
    model = load_robot("Panda").to_pinocchio()
    data = model.createData()
    rng = np.random.default_rng(0)
    for _ in range(20):
        q, v, a, e, de = rng.normal(size=(5, model.nv))
        tau = computed_torque(
            mass_matrix=pin.crba(model, data, q).copy(),
            bias=pin.nle(model, data, q, v).copy(),
            acceleration=a,
            position_error=e,
            velocity_error=de,
            kp=100.0,
            kd=20.0,
        )
        wanted = a + 100.0 * e + 20.0 * de
        np.testing.assert_allclose(tau, pin.rnea(model, data, q, v, wanted), atol=1e-8)


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


def test_the_reference_is_smooth_and_stays_between_solved_configurations():
    model = load_robot("Panda").to_pinocchio()
    index = np.arange(3)
    reference = Reference(model, index, index, 0.01)
    q0 = np.zeros(model.nq)
    reference.reset(q0)
    rng = np.random.default_rng(1)
    solved, positions, velocities = [q0[:3]], [], []
    for _ in range(20):
        v = np.zeros(model.nv)
        v[:3] = rng.normal(size=3)
        solved.append(reference.extend(v)[:3])
        for s in (0.0025, 0.005, 0.0075, 0.01):
            target = reference.sample(s, np.zeros(0))
            positions.append(target.position)
            velocities.append(target.velocity)
            low = np.min(solved[-3:], axis=0)
            high = np.max(solved[-3:], axis=0)
            assert (target.position >= low - 1e-12).all()
            assert (target.position <= high + 1e-12).all()
    steps = np.diff(positions, axis=0) / 0.0025
    means = 0.5 * (np.array(velocities)[1:] + np.array(velocities)[:-1])
    np.testing.assert_allclose(steps, means, atol=1e-9)
