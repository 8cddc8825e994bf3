"""Gait planners alone: a point mass on legs without mass stands for the robot."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wbc_suite.locomotion import (
    TrotConfig,
    WalkConfig,
    begin_gait,
    make_gait,
    make_measured,
    make_plan,
    plan_trot,
    plan_walk,
)
from wbc_suite.locomotion.gait import GRAVITY, Mode
from wbc_suite.locomotion.swing import minimum_jerk, write_swing

SOLE = (-0.09, 0.09, -0.03, 0.03)
DT = 0.002
BIPED = np.array([[0.0, 0.1, 0.0], [0.0, -0.1, 0.0]])
QUADRUPED = np.array([[0.3, 0.2, 0], [0.3, -0.2, 0], [-0.3, 0.2, 0], [-0.3, -0.2, 0]])


class Pendulum:
    """A linear inverted pendulum under a planner; feet arrive where they are sent."""

    def __init__(self, plan, config, feet, soles, height):
        self.planner, self.gait = plan, make_gait(config, soles)
        self.measured, self.plan = make_measured(len(feet)), make_plan(len(feet))
        self.measured.com[:] = 0.0, 0.0, height
        self.measured.foot[:] = feet
        self.v = self.measured.com_velocity
        begin_gait(self.gait, self.measured, 0.0)
        self.stances, self.durations, self.places = [], [], []

    def run(self, seconds, walk=(0.0, 0.0, 0.0), height=0.0, push=(0.0, 0.0)):
        state, command = self.gait.state[0], np.array([*walk, height])
        self.v[:2] += push
        for _ in range(round(seconds / DT)):
            before, duration = int(state["stance"]), float(state["duration"])
            swings = self.gait.swings.copy()
            self.planner(self.gait, self.measured, command, DT, self.plan)
            for k in np.flatnonzero(self.gait.swings):
                self.measured.foot[k] = self.plan.position[k]
                self.measured.foot[k, 2] = max(self.measured.foot[k, 2], 0.0)
            for k in np.flatnonzero((self.gait.swings == 0) & (swings == 1)):
                self.measured.foot[k, 2] = 0.0
            if state["stance"] != before:
                self.stances.append(int(state["stance"]))
                self.durations.append(duration)
                foot = self.measured.foot
                self.places.append(foot[state["stance"]] - foot[before])
            self.v += DT * self.plan.com_acceleration
            self.measured.com[:] += DT * self.v
        return self


def biped(**changes):
    soles = np.array([SOLE, SOLE])
    return Pendulum(plan_walk, WalkConfig(**changes), BIPED, soles, 0.8)


def quadruped(**changes):
    config = TrotConfig(**changes)
    return Pendulum(plan_trot, config, QUADRUPED, np.zeros((4, 4)), 0.46)


def test_a_robot_without_a_command_stands_on_all_feet():
    for robot in (biped(), quadruped()):
        robot.run(3.0)
        assert robot.gait.state["mode"][0] == Mode.STAND
        np.testing.assert_array_equal(robot.plan.load, 1.0)
        np.testing.assert_allclose(robot.measured.com[:2], 0.0, atol=1e-3)
        assert robot.gait.state["steps"][0] == 0


@pytest.mark.parametrize(
    "walk", [(0.4, 0, 0), (-0.2, 0, 0), (0, 0.15, 0), (0.2, 0.1, 0)]
)
def test_a_walk_takes_the_commanded_velocity(walk):
    robot = biped().run(4.0, walk)
    start = robot.measured.com.copy()
    robot.run(4.0, walk)
    found = (robot.measured.com - start)[:2] / 4.0
    np.testing.assert_allclose(found, walk[:2], atol=0.02)
    assert set(np.abs(np.diff(robot.stances))) == {1}


def test_steps_keep_their_limits_after_a_push():
    config = WalkConfig()
    robot = biped().run(4.0, (0.2, 0.0, 0.0)).run(4.0, (0.2, 0, 0), push=(0.3, -0.25))
    assert min(robot.durations) >= config.shortest - DT
    assert max(robot.durations) <= config.step + DT
    for stance, (x, y, _) in zip(robot.stances, robot.places, strict=True):
        side = y if stance == 0 else -y
        assert config.narrowest - 0.02 <= side <= config.widest + 0.02
        assert -config.backward - 0.02 <= x <= config.forward + 0.02
    np.testing.assert_allclose(robot.v[:2].mean(), 0.1, atol=0.25)
    assert np.abs(robot.measured.com[1]) < 1.0


def test_a_walk_turns_with_its_feet():
    robot = biped().run(8.0, (0.0, 0.0, 0.4))
    state = robot.gait.state[0]
    assert state["yaw"] == pytest.approx(0.4 * 8.0, abs=0.7)
    assert np.ptp([*robot.plan.yaw, state["yaw"]]) < 0.5


def test_a_biped_steps_by_itself_when_pushed_and_then_stands():
    robot = biped().run(1.0).run(6.0, push=(0.0, 0.6))
    assert robot.durations
    assert robot.gait.state["mode"][0] == Mode.STAND
    np.testing.assert_allclose(robot.v, 0.0, atol=0.02)
    fixed = biped(recover=False).run(1.0).run(0.3, push=(0.0, 0.6))
    assert fixed.gait.state["mode"][0] == Mode.STAND
    assert fixed.gait.state["steps"][0] == 0


def test_a_step_waits_for_a_foot_that_is_late():
    robot = biped().run(2.0, (0.2, 0.0, 0.0))
    state, foot, steps = robot.gait.state[0], robot.measured.foot, []
    while state["progress"] < 0.9:
        robot.run(DT, (0.2, 0.0, 0.0))
    stance = int(state["stance"])
    robot.measured.rise[:] = -0.5  # it sinks
    for _ in range(100):
        foot[1 - stance, 2] = 0.05
        robot.planner(robot.gait, robot.measured, np.zeros(4), DT, robot.plan)
        steps.append(state["since"] - state["duration"])
        if state["stance"] != stance:
            break
    assert state["stance"] != stance  # not for ever
    assert max(steps) == pytest.approx(0.1, abs=2 * DT)


@pytest.mark.parametrize("walk", [(1.0, 0, 0), (-0.5, 0, 0), (0, 0.4, 0)])
def test_a_trot_takes_the_commanded_velocity(walk):
    robot = quadruped().run(3.0, walk)
    start = robot.measured.com.copy()
    robot.run(4.0, walk)
    found = (robot.measured.com - start)[:2] / 4.0
    np.testing.assert_allclose(found, walk[:2], atol=0.05)


def test_diagonal_feet_trot_together():
    robot = quadruped()
    seen = set()
    for _ in range(1000):
        robot.run(DT, (0.5, 0.0, 0.0))
        seen.add(tuple(robot.gait.swings))
    assert seen - {(0, 0, 0, 0)} == {(1, 0, 0, 1), (0, 1, 1, 0)}


def test_a_trot_stops_and_holds_the_height_that_is_asked_for():
    robot = quadruped().run(3.0, (0.6, 0.0, 0.0)).run(4.0, height=-0.1)
    assert robot.gait.state["mode"][0] == Mode.STAND
    assert robot.measured.com[2] == pytest.approx(0.36, abs=1e-3)
    np.testing.assert_allclose(robot.v, 0.0, atol=0.01)


def test_the_centre_of_pressure_explains_the_acceleration():
    robot = biped().run(3.0, (0.3, 0.0, 0.0))
    omega = np.sqrt(GRAVITY / (0.8 - WalkConfig().lower))
    away = robot.measured.com[:2] - DT * robot.v[:2] - robot.plan.zmp
    expected = omega**2 * away
    np.testing.assert_allclose(robot.plan.com_acceleration[:2], expected, atol=0.02)


@given(s=st.floats(0.01, 0.99))
def test_minimum_jerk_has_the_derivatives_that_it_says(s):
    h = 1e-5
    before, after = minimum_jerk(s - h), minimum_jerk(s + h)
    _, rate, curve = minimum_jerk(s)
    assert (after[0] - before[0]) / (2 * h) == pytest.approx(rate, abs=1e-6)
    assert (after[1] - before[1]) / (2 * h) == pytest.approx(curve, abs=1e-5)


def test_a_swing_leads_from_lift_to_goal_over_its_apex():
    plan, lift, goal = make_plan(1), np.array([0.1, 0.2, 0.01]), np.array([0.4, 0.1])
    path = []
    for s in np.linspace(0.0, 1.0, 501):
        write_swing(plan, 0, lift, goal, 0.0, 0.06, s, 0.4)
        path.append((plan.position[0].copy(), plan.velocity[0].copy()))
    position, velocity = map(np.array, zip(*path, strict=True))
    np.testing.assert_allclose(position[0], lift, atol=1e-12)
    np.testing.assert_allclose(position[-1, :2], goal, atol=1e-12)
    assert position[:, 2].max() == pytest.approx(0.06)
    assert -0.01 < position[-1, 2] < 0.0  # it reaches for the ground
    slope = np.gradient(position, 0.4 / 500, axis=0)
    np.testing.assert_allclose(slope[2:-2], velocity[2:-2], atol=0.01)
    np.testing.assert_allclose(velocity[[0, -1]], 0.0, atol=1e-9)


HUGE = st.floats(-1e6, 1e6)


@settings(max_examples=200)
@given(
    com=st.tuples(HUGE, HUGE, st.floats(-10, 10)),
    velocity=st.tuples(HUGE, HUGE, HUGE),
    feet=st.lists(st.tuples(HUGE, HUGE, HUGE), min_size=4, max_size=4),
    command=st.tuples(*[st.floats(-10, 10)] * 3, st.floats(-0.3, 0.3)),
    steps=st.integers(1, 30),
)
def test_planners_answer_hostile_states_with_numbers(
    com, velocity, feet, command, steps
):
    for robot, count in ((biped(), 2), (quadruped(), 4)):
        robot.run(0.6)
        robot.measured.com[:], robot.v[:] = com, velocity
        robot.measured.foot[:] = feet[:count]
        for _ in range(steps):
            robot.planner(robot.gait, robot.measured, np.array(command), DT, robot.plan)
        for found in robot.plan:
            assert np.isfinite(found).all()
