import numpy as np
import pytest

from wbc_suite.control.composite.travel import Passed, Router
from wbc_suite.robot import load_robot

SPEED, RATE = np.full(9, 2.0), np.full(9, 8.0)


def behind_a_wall(q):
    """Return the room there is: a wall at 0 rad of joint 1, open where 2 is low."""
    return max(abs(q[0]) - 0.2, -0.7 - q[1])


def router(room):
    model = load_robot("Panda").to_pinocchio()
    return Router(model, room, speed=SPEED, rate=RATE)


def at(first, second=0.0, *, time=0.0, v=0.0):
    q = np.zeros(9)
    q[:2], q[3] = (first, second), -2.0
    return Passed(time, q, np.full(9, v) * (np.arange(9) == 0))


def drain(steps):
    """Return what a generator returns."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def least_room(way, room):
    times = np.linspace(0.0, way.motion.duration, 300)
    return min(room(way.place(way.motion.state(time)[0])) for time in times)


def test_the_direct_way_is_the_fastest_one():
    way = router(lambda q: 1.0).direct(at(0.0), at(1.0).q)
    assert way is not None
    # d / v + v / a, from rest to rest.
    assert way.left == pytest.approx(0.5 + 0.25)


def test_the_direct_way_is_refused_where_it_is_blocked():
    assert router(behind_a_wall).direct(at(-1.0), at(1.0).q) is None


def test_a_way_out_of_what_is_too_near_must_lead_away():
    inside = router(lambda q: q[0] - 0.05)
    assert inside.direct(at(0.0), at(1.0).q) is not None
    through = router(lambda q: 10.0 * abs(q[0] - 0.02) - 0.3)
    assert through.direct(at(0.0), at(1.0).q) is None


def test_a_joint_that_gathers_speed_slowly_has_more_to_make_up():
    rate = np.where(np.arange(9) == 1, 0.5, RATE)
    model = load_robot("Panda").to_pinocchio()
    plan = Router(model, lambda q: 1.0, speed=SPEED, rate=rate)
    way = plan.direct(at(0.0), at(1.0).q)
    assert plan.late(way, at(0.02)) == pytest.approx(0.01)
    assert plan.recovery(way, at(0.02)) == pytest.approx(0.05)
    assert plan.recovery(way, at(0.0, 0.02)) == pytest.approx(0.2)


def test_the_way_back_is_the_way_that_came():
    trail = [
        at(np.cos(angle), -1.2 * np.sin(angle), time=2.0 - 0.05 * k)
        for k, angle in enumerate(np.linspace(0.1, np.pi - 0.1, 40))
    ]
    now = Passed(2.05, trail[0].q, np.zeros(9))
    plan = router(behind_a_wall)
    way = drain(plan.back(now, at(-1.0).q, trail))
    assert way is not None
    assert least_room(way, behind_a_wall) > -0.05
    np.testing.assert_allclose(way.place(way.motion.end), at(-1.0).q, atol=1e-6)
    before = way.left
    drain(plan.shorten(way))
    assert way.left < before
    assert least_room(way, behind_a_wall) > -0.05


def test_a_way_round_is_found_without_a_trail():
    plan = router(behind_a_wall)
    way = plan.stop(at(-1.0, v=-1.0))
    stopping = way.left
    drain(plan.round(way, at(1.0).q))
    assert way.left > stopping
    assert least_room(way, behind_a_wall) > -0.05
    np.testing.assert_allclose(way.place(way.motion.end), at(1.0).q, atol=1e-6)


def test_a_robot_that_was_held_up_takes_a_short_cut():
    plan = router(lambda q: 1.0)
    way = plan.stop(at(0.0, v=-2.0))
    goal = at(1.0).q
    drain(plan.round(way, goal))
    way.clock = 0.2
    held = at(0.0)  # it never went out and so need not come back
    before = way.left
    assert plan.late(way, held) > 0.1
    plan.rejoin(way, held)
    assert way.left < before - 0.2
    np.testing.assert_allclose(way.place(way.motion.state(0.0)[0]), held.q, atol=1e-9)
    np.testing.assert_allclose(way.place(way.motion.end), goal, atol=1e-6)


def test_a_robot_that_could_not_go_out_leaps_to_where_it_comes_back():
    plan = router(lambda q: 1.0)
    trail = [at(-0.1 * k, time=1.0 - 0.05 * k, v=2.0) for k in range(1, 20)]
    now = at(0.0, time=1.0, v=2.0)
    way = drain(plan.back(now, at(-1.0).q, trail))
    assert way is not None
    way.clock = 0.2  # 0.24 m out, were it not for what is there
    held = at(0.05)
    assert plan.late(way, held) > 0.05
    plan.rejoin(way, held)
    assert plan.late(way, held) < 0.03
    assert way.clock == pytest.approx(0.5 - 0.2 * 0.14, abs=0.03)
