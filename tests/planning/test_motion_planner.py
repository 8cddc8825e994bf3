import numpy as np
import pytest

from wbc_suite.planning import MotionPlanner, TimedState
from wbc_suite.robot import load_robot

SPEED, RATE = np.full(9, 2.0), np.full(9, 8.0)


def wall(q):
    """Return the clearance: a wall at 0 rad of joint 1, open where 2 is low."""
    return max(abs(q[0]) - 0.2, -0.7 - q[1])


def planner(clearance):
    model = load_robot("Panda").to_pinocchio()
    return MotionPlanner(model, clearance, speed=SPEED, acceleration=RATE)


def at(first, second=0.0, *, time=0.0, v=0.0):
    q = np.zeros(9)
    q[:2], q[3] = (first, second), -2.0
    return TimedState(time, q, np.full(9, v) * (np.arange(9) == 0))


def drain(steps):
    """Return what a generator returns."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def least_clearance(motion, clearance):
    times = np.linspace(0.0, motion.trajectory.duration, 300)
    return min(
        clearance(motion.configuration_of(motion.trajectory.state(time)[0]))
        for time in times
    )


def test_the_direct_motion_is_the_fastest_one():
    motion = planner(lambda q: 1.0).direct(at(0.0), at(1.0).q)
    assert motion is not None
    # d / v + v / a, from rest to rest.
    assert motion.remaining == pytest.approx(0.5 + 0.25)


def test_the_direct_motion_is_refused_where_it_is_blocked():
    assert planner(wall).direct(at(-1.0), at(1.0).q) is None


def test_a_motion_out_of_a_collision_must_lead_away():
    inside = planner(lambda q: q[0] - 0.05)
    assert inside.direct(at(0.0), at(1.0).q) is not None
    through = planner(lambda q: 10.0 * abs(q[0] - 0.02) - 0.3)
    assert through.direct(at(0.0), at(1.0).q) is None


def test_a_joint_that_gathers_speed_slowly_has_more_to_make_up():
    rate = np.where(np.arange(9) == 1, 0.5, RATE)
    model = load_robot("Panda").to_pinocchio()
    plan = MotionPlanner(model, lambda q: 1.0, speed=SPEED, acceleration=rate)
    motion = plan.direct(at(0.0), at(1.0).q)
    assert plan.delay(motion, at(0.02)) == pytest.approx(0.01)
    assert plan.catch_up_time(motion, at(0.02)) == pytest.approx(0.05)
    assert plan.catch_up_time(motion, at(0.0, 0.02)) == pytest.approx(0.2)


def test_a_motion_back_follows_the_trail():
    trail = [
        at(np.cos(angle), -1.2 * np.sin(angle), time=2.0 - 0.05 * k)
        for k, angle in enumerate(np.linspace(0.1, np.pi - 0.1, 40))
    ]
    now = TimedState(2.05, trail[0].q, np.zeros(9))
    plan = planner(wall)
    motion = drain(plan.retrace(now, at(-1.0).q, trail))
    assert motion is not None
    assert least_clearance(motion, wall) > -0.05
    np.testing.assert_allclose(motion.goal, at(-1.0).q, atol=1e-6)
    before = motion.remaining
    drain(plan.shorten(motion))
    assert motion.remaining < before
    assert least_clearance(motion, wall) > -0.05


def test_a_motion_around_is_found_without_a_trail():
    plan = planner(wall)
    motion = plan.stop(at(-1.0, v=-1.0))
    stopping = motion.remaining
    drain(plan.around(motion, [at(1.0).q]))
    assert motion.remaining > stopping
    assert least_clearance(motion, wall) > -0.05
    np.testing.assert_allclose(motion.goal, at(1.0).q, atol=1e-6)


def test_a_motion_around_leads_to_the_first_goal_that_has_one():
    shut, free = at(1.0, 0.5).q, at(1.0).q
    plan = planner(lambda q: min(wall(q), np.abs(q - shut).max() - 0.3))
    motion = plan.stop(at(-1.0, v=-1.0))
    drain(plan.around(motion, [shut, free]))
    np.testing.assert_allclose(motion.goal, free, atol=1e-6)


def test_a_delayed_robot_rejoins_its_motion_directly():
    plan = planner(lambda q: 1.0)
    motion = plan.stop(at(0.0, v=-2.0))
    goal = at(1.0).q
    drain(plan.around(motion, [goal]))
    motion.clock = 0.2
    held = at(0.0)  # it never went out and so need not come back
    before = motion.remaining
    assert plan.delay(motion, held) > 0.1
    plan.rejoin(motion, held)
    assert motion.remaining < before - 0.2
    np.testing.assert_allclose(
        motion.configuration_of(motion.trajectory.state(0.0)[0]), held.q, atol=1e-9
    )
    np.testing.assert_allclose(motion.goal, goal, atol=1e-6)


def test_a_robot_that_could_not_go_out_skips_to_where_it_comes_back():
    plan = planner(lambda q: 1.0)
    trail = [at(-0.1 * k, time=1.0 - 0.05 * k, v=2.0) for k in range(1, 20)]
    now = at(0.0, time=1.0, v=2.0)
    motion = drain(plan.retrace(now, at(-1.0).q, trail))
    assert motion is not None
    motion.clock = 0.2  # 0.24 m out, were it not for what is there
    held = at(0.05)
    assert plan.delay(motion, held) > 0.05
    plan.rejoin(motion, held)
    assert plan.delay(motion, held) < 0.03
    assert motion.clock == pytest.approx(0.5 - 0.2 * 0.14, abs=0.03)
