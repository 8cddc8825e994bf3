import numpy as np
import pinocchio as pin
import pytest
import textbook_approach

from wbc_suite.control.law.approach import approach_pose, approach_speed
from wbc_suite.control.law.spline_reference import SplineReference, window_length
from wbc_suite.control.poses import pose_of, row_of, write_turn
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.lie import log3
from wbc_suite.robot import load_robot


def nearer(now, goal, *, dt, gain, speed, acceleration):
    """Return the nearer goal by the kernels."""
    error, turn, target = np.zeros(6), np.zeros((3, 3)), np.zeros(12)
    error[:3] = goal.translation - now.translation
    write_turn(row_of(now), row_of(goal), turn)
    log3(turn, error[3:])
    limits = np.array(speed), np.array(acceleration)
    approach_pose(row_of(now), error, dt, gain, 1.0, *limits, target)
    return pose_of(target)


def test_approach_never_brakes_harder_than_asked():
    d = np.linspace(1e-6, 2.0, 20000)
    v = np.array([approach_speed(x, 1.0 / 50.0, 4.0) for x in d.tolist()])
    deceleration = v[1:] * np.diff(v) / np.diff(d)
    assert deceleration.max() <= 4.0 + 1e-3
    assert v[0] == pytest.approx(50.0 * d[0], rel=1e-3)


def test_approach_from_far_takes_about_the_time_of_the_parabola():
    now, goal = pin.SE3.Identity(), pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.0]))
    dt, gain, ticks = 0.01, 0.5, 0
    while np.linalg.norm(goal.translation - now.translation) > 1e-3:
        target = nearer(
            now, goal, dt=dt, gain=gain, speed=(9.0, 9.0), acceleration=(4.0, 9.0)
        )
        now.translation += gain * (target.translation - now.translation)
        ticks += 1
    assert dt * ticks == pytest.approx(np.sqrt(2 * 0.5 / 4.0), abs=0.1)


def test_a_nearer_goal_is_that_of_the_formula():
    rng = np.random.default_rng(0)
    for size in (0.0, 1e-6, 1e-2, 0.3, 2.0):
        now = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3))
        goal = now * pin.exp6(size * rng.normal(size=6))
        settings = {"dt": 0.01, "gain": 0.4, "speed": (0.5, 2.0)}
        settings["acceleration"] = (3.0, 9.0)
        expected = textbook_approach.approach_pose(now, goal, **settings)
        found = nearer(now, goal, **settings)
        np.testing.assert_allclose(found, expected, atol=1e-13)


def sampled_reference(mean, rates, samples=4):
    """Return solved configurations, then p, v, a of the reference, sampled finely."""
    model = load_robot("Panda").to_pinocchio()
    index = np.arange(3)
    configuration = Configuration(model, np.zeros(model.nq))
    reference = SplineReference(configuration, index, index, 0.01, mean=mean)
    solved, sampled = [np.zeros(3)], []
    for rate in rates:
        v = np.zeros(model.nv)
        v[:3] = rate
        reference.extend(v)
        solved.append(configuration.q[:3].copy())
        p, r, c, j = reference.motion.copy()
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
    assert window_length(most, jerk, dt) <= mean
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
    configuration = Configuration(model)
    reference = SplineReference(configuration, none, none, 0.01, mean=3)
    rng = np.random.default_rng(2)
    for _ in range(8):
        reference.extend(rng.normal(size=model.nv))
        assert np.linalg.norm(reference.start[3:7]) == pytest.approx(1.0, abs=1e-12)
    for _ in range(5):
        reference.extend(np.zeros(model.nv))
    expected = pin.XYZQUATToSE3(configuration.q[:7])
    found = pin.XYZQUATToSE3(reference.start[:7])
    np.testing.assert_allclose(found.homogeneous, expected.homogeneous, atol=1e-12)
    assert np.abs(reference.root).max() < 1e-8
