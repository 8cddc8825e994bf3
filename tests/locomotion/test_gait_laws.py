"""Laws of the gaits against formulas: feedback, loads, footholds, symmetries."""

import copy
import functools
import itertools

import numpy as np
import pytest
from test_planners import BIPED, DT, QUADRUPED, SOLE, Pendulum, biped, quadruped

from wbc_suite.locomotion import TrotConfig, WalkConfig, plan_trot, plan_walk, walk
from wbc_suite.locomotion.gait import GRAVITY, Mode, heading_axes
from wbc_suite.locomotion.soles import keep_in_soles

NO_WALK = np.zeros(4)
WALK, TROT = (0.2, 0.0, 0.0), (0.4, 0.0, 0.0)


@functools.cache
def _moving(make, walk, seconds):
    return make().run(seconds, walk)


def moving(make, walk, seconds=1.5):
    """Return a robot that has moved for a while; the same for all tests."""
    return copy.deepcopy(_moving(make, walk, seconds))


def ask(robot, command=NO_WALK):
    """Call the planner once, without moving the robot."""
    robot.planner(robot.gait, robot.measured, np.array(command), DT, robot.plan)
    return robot.plan


def standing(robot, *, at=(0.0, 0.0), velocity=(0.0, 0.0), height=0.0):
    """Return a robot that has stood for a second, at another place or speed."""
    robot.run(1.0)
    robot.measured.com[:2] = at
    robot.measured.com[2] += height
    robot.v[:2], robot.v[2] = velocity, 0.0
    return robot


def dcm_of(robot, height=0.78):
    omega = np.sqrt(GRAVITY / height)
    return robot.measured.com[:2] + robot.v[:2] / omega, omega


@pytest.mark.parametrize(("recover", "rate"), [(True, 4.0), (False, 20.0)])
def test_the_dcm_returns_with_the_rate_of_the_gain(recover, rate):
    """xi' = omega (xi - z) = -gain (xi - xi_ref)."""
    robot = standing(biped(recover=recover), at=(0.004, -0.003))
    plan = ask(robot)
    dcm, omega = dcm_of(robot)
    np.testing.assert_allclose(omega * (dcm - plan.zmp), -rate * dcm, rtol=1e-9)
    before = np.linalg.norm(dcm)
    robot.run(0.1)
    after = np.linalg.norm(dcm_of(robot)[0])
    assert after / before == pytest.approx((1.0 - rate * DT) ** 50, rel=0.02)


def test_the_walk_tracks_its_dcm_with_the_rate_of_the_gain():
    """Two plans whose DCM differ by 2 mm differ by the law's feedback on it."""
    robot = moving(biped, WALK)
    while robot.gait.state["since"][0] < 0.25:
        robot.run(DT, (0.2, 0.0, 0.0))
    zmp = []
    for shift in (0.0, 0.002):
        state = robot.gait.state.copy()
        robot.measured.com[1] += shift
        zmp.append(ask(robot, (0.2, 0, 0, 0)).zmp.copy())
        robot.gait.state[:] = state
    omega = np.sqrt(GRAVITY / 0.78)
    change = zmp[1] - zmp[0]
    np.testing.assert_allclose(change, [0.0, 0.002 * (1 + 4.0 / omega)], atol=1e-9)


@pytest.mark.parametrize(
    ("robot", "kp", "kd", "carried"),
    [(biped, 100.0, 20.0, 0.78), (quadruped, 150.0, 24.0, 0.46)],
)
def test_height_is_held_by_a_spring_and_a_damper(robot, kp, kd, carried):
    robot = standing(robot())
    robot.measured.com[2], robot.v[2] = carried + 0.03, -0.2
    assert ask(robot).com_acceleration[2] == pytest.approx(-kp * 0.03 + kd * 0.2)


@pytest.mark.parametrize("side", [1, -1])
def test_a_push_to_a_side_begins_a_step_on_the_foot_of_that_side(side):
    robot = standing(biped(), velocity=(0.0, 0.9 * side))
    ask(robot)
    state = robot.gait.state[0]
    assert state["mode"] == Mode.STEP
    assert state["stance"] == (1 if side > 0 else 0)
    assert state["until"] == pytest.approx(state["time"] + 1.6, abs=DT)


@pytest.mark.parametrize("beyond", [-0.002, 0.002])
def test_a_robot_steps_once_its_dcm_is_a_centimetre_outside_the_soles(beyond):
    """The box of the soles, inset by the margin of 6 mm, ends at 0.124 m."""
    robot = standing(biped(), at=(0.0, 0.1 + 0.03 - 0.006 + 0.01 + beyond))
    assert (ask(robot).margin[0] < -0.01) == (beyond > 0.0)
    assert (robot.gait.state["mode"][0] == Mode.STEP) == (beyond > 0.0)


def test_no_step_begins_in_the_first_half_second():
    robot = biped()
    robot.run(0.3)
    robot.v[1] = 0.9
    ask(robot)
    assert robot.gait.state["mode"][0] == Mode.STAND


def test_a_walk_begins_when_the_weight_has_shifted_to_a_foot():
    """In 0.6 s the reference moves from the middle to where the first step begins."""
    robot = standing(biped())
    shifts = []
    while robot.gait.state["mode"][0] == Mode.STAND:
        robot.run(DT, (0.2, 0.0, 0.0))
        shifts.append(float(robot.gait.state["shift"][0]))
    ramp = np.arange(1, 101) * DT / 0.6
    np.testing.assert_allclose(shifts[:100], ramp, atol=1e-9)
    dcm, _ = dcm_of(robot)
    stance = robot.measured.foot[robot.gait.state["stance"][0], 1]
    assert stance == pytest.approx(0.1)
    assert 0.3 * stance < dcm[1] < stance  # over the foot's inner side
    assert len(shifts) * DT < 1.2


def test_the_periodic_walk_has_the_steps_of_its_recursion():
    """b_k e^(omega T) = d_k + b_(k+1), with the DCM b about the foot that stands."""
    robot = moving(biped, (0.3, 0.05, 0.0), 3.5)
    omega, found = np.sqrt(GRAVITY / 0.78), []
    for _ in range(3):
        steps = robot.gait.state["steps"][0]
        while robot.gait.state["steps"][0] == steps:
            robot.run(DT, (0.3, 0.05, 0.0))
        foot = robot.measured.foot[robot.gait.state["stance"][0], :2]
        found.append((foot.copy(), dcm_of(robot)[0] - foot))
    growth = np.exp(omega * 0.5)
    for (foot, now), (other, after) in itertools.pairwise(found):
        np.testing.assert_allclose(now * growth, other - foot + after, atol=0.03)
        np.testing.assert_allclose(other[0] - foot[0], 0.3 * 0.5, atol=0.01)


def test_weight_moves_to_the_new_foot_in_the_double_support():
    robot = moving(biped, WALK)
    state, seen = robot.gait.state, 0
    for _ in range(300):
        robot.run(DT, (0.2, 0.0, 0.0))
        since, stance = float(state["since"][0]), int(state["stance"][0])
        if since < 0.08 - 1e-9:
            left = max(1.0 - since / 0.08, 0.03)
            taken = min(1.0, since / 0.03 + 0.3)
            np.testing.assert_allclose(
                robot.plan.load[[1 - stance, stance]], [left, taken], atol=1e-9
            )
            assert not robot.gait.swings.any()
            seen += 1
        else:
            np.testing.assert_array_equal(robot.plan.load[[1 - stance, stance]], [0, 1])
            assert robot.gait.swings[1 - stance] == 1
    assert seen > 30


@pytest.mark.parametrize(
    ("robot", "walk", "apex"),
    [(biped, WALK, 0.05), (quadruped, TROT, 0.07)],
)
def test_feet_swing_over_their_apex(robot, walk, apex):
    robot = moving(robot, walk)
    highest = 0.0
    for _ in range(300):
        robot.run(DT, walk)
        highest = max(highest, robot.measured.foot[:, 2].max())
    assert highest == pytest.approx(apex, abs=0.002)


def test_a_swinging_foot_turns_to_the_heading_of_its_landing():
    robot = moving(biped, (0.0, 0.0, 0.4), 2.0)
    for _ in range(150):
        robot.run(DT, (0.0, 0.0, 0.4))
        state = robot.gait.state[0]
        for k in np.flatnonzero(robot.gait.swings):
            left = state["duration"] - state["since"] + DT
            yaw = state["yaw"] + 0.4 * max(left, DT)
            assert robot.plan.yaw[k] == pytest.approx(yaw, abs=1e-9)


def test_a_pushed_robot_lands_earlier_but_never_at_once():
    """Place and time of a step are fixed 60 ms before it ends."""
    robot = moving(biped, WALK)
    state, shortened = robot.gait.state, 0
    for _ in range(4):
        while not 0.15 < state["since"][0] < 0.3:
            robot.run(DT, (0.2, 0.0, 0.0))
        robot.v[1] += 0.4 if state["stance"][0] == 0 else -0.4  # beyond the foot
        for _ in range(60):
            since, before = float(state["since"][0]), float(state["duration"][0])
            robot.run(DT, (0.2, 0.0, 0.0))
            after = float(state["duration"][0])
            if state["since"][0] > since and after != before:
                assert after >= max(state["since"][0] + 0.06, 0.22) - 1e-9
                assert after <= 0.5 + 1e-9
                shortened += after < 0.45
            if since > before - 0.06 + DT and state["since"][0] > since:
                assert after == before
    assert shortened > 1


@pytest.mark.parametrize(
    ("since", "beyond", "duration"),
    [(0.05, 0.3, 0.22), (0.3, 0.3, 0.36), (0.4, 0.3, 0.46), (0.3, 0.0, 0.5)],
)
def test_a_step_ends_as_soon_as_it_may_where_the_dcm_runs_away(since, beyond, duration):
    """What legs cannot reach costs ten times its length; a change of time 0.3 / s."""
    robot = moving(biped, WALK)
    state, omega = robot.gait.state[0], np.sqrt(GRAVITY / 0.78)
    state["since"], state["duration"] = since, 0.5
    stance = int(state["stance"])
    foot, side = robot.measured.foot[stance, :2], 1.0 if stance == 0 else -1.0
    zmp, landing = foot.copy(), np.array([0.0, 0.05 * side])
    out = np.array([0.0, side * beyond])
    inside = np.add(landing, [0.0, -0.2 * side]) * np.exp(-omega * (0.5 - since))
    dcm = zmp + (out if beyond else inside)
    walk._choose_duration(robot.gait, robot.measured, dcm, zmp, landing, omega, True)
    assert state["duration"] == pytest.approx(duration)


def test_a_step_lands_where_the_dcm_is_that_of_the_periodic_walk():
    """The foothold: z + (xi - z) e^(omega t) - b', within what legs reach."""
    walk = WALK
    robot = moving(biped, walk, 2.5)
    while not 0.2 < robot.gait.state["since"][0] < 0.25:
        robot.run(DT, walk)
    dcm, omega = dcm_of(robot)
    plan, state = ask(robot, (*walk, 0)), robot.gait.state[0]
    growth = np.exp(omega * 0.5)
    side = -1.0 if state["stance"] == 0 else 1.0
    after = (-side * 0.2 + side * 0.2 / growth) * growth / (growth**2 - 1.0)
    landing = np.array([0.1 / (growth - 1.0), after])
    grown = np.exp(omega * (state["duration"] - state["since"]))
    place = plan.zmp + (dcm - plan.zmp) * grown - landing
    np.testing.assert_allclose(plan.footstep, place, atol=2e-3)


@pytest.mark.parametrize(
    ("walk", "kp", "kd"), [((0, 0, 0), 60.0, 20.0), (TROT, 10.0, 8.0)]
)
def test_a_trot_holds_its_reference_by_a_spring_and_a_damper(walk, kp, kd):
    """Two plans differ by the gains where place and speed do."""
    robot = moving(quadruped, walk)
    found = []
    for at, speed in ((0.0, 0.0), (0.01, 0.0), (0.0, 0.05)):
        state, swings = robot.gait.state.copy(), robot.gait.swings.copy()
        robot.measured.com[1] += at
        robot.v[1] += speed
        found.append(ask(robot, (*walk, 0)).com_acceleration[1])
        robot.measured.com[1] -= at
        robot.v[1] -= speed
        robot.gait.state[:], robot.gait.swings[:] = state, swings
    assert found[1] - found[0] == pytest.approx(-0.01 * kp, rel=1e-6)
    assert found[2] - found[0] == pytest.approx(-0.05 * kd, rel=1e-6)


def test_a_trot_accelerates_by_12_m_s2_at_most():
    robot = standing(quadruped(recover=False), at=(0.3, -0.2), velocity=(2.0, 0.0))
    plan = ask(robot)
    assert plan.com_acceleration[0] == -12.0
    assert 0.0 < plan.com_acceleration[1] < 12.0  # the leash: 0.1 m times 60 / s^2
    assert plan.com_acceleration[1] <= 6.0


@pytest.mark.parametrize("walk", [(0, 0, 0), TROT])
def test_the_centre_of_pressure_of_a_trot_explains_its_acceleration(walk):
    robot = moving(quadruped, walk)
    robot.measured.com[:2] += 0.01, -0.005
    plan = ask(robot, (*walk, 0))
    expected = GRAVITY / 0.46 * (robot.measured.com[:2] - plan.zmp)
    np.testing.assert_allclose(plan.com_acceleration[:2], expected, rtol=1e-9)
    assert np.abs(plan.com_acceleration[:2]).max() > 0.01


def test_loads_of_a_trot_rise_and_fall_within_30_ms():
    robot, config = moving(quadruped, TROT), TrotConfig()
    for _ in range(300):
        robot.run(DT, TROT)
        for k in range(4):
            phase = (robot.gait.state["phase"][0] + robot.gait.offset[k]) % 1.0
            since = phase * config.period
            left = config.duty * config.period - since
            expected = min(1.0, min(since, left) / 0.03 + 0.2) if left > 1e-9 else 0.0
            if abs(left) > 1e-9:
                assert robot.plan.load[k] == pytest.approx(expected, abs=1e-9)
                assert robot.gait.swings[k] == (left < 0.0)


def test_a_foot_of_a_trot_lands_by_the_capture_point_under_its_hip():
    walk = (0.5, -0.1, 0.0)
    robot, config = moving(quadruped, walk), TrotConfig()
    robot.v[:2] += 0.1, 0.06
    plan = ask(robot, (*walk, 0))
    state, com, v = robot.gait.state[0], robot.measured.com[:2], robot.v[:2]
    wanted = np.array(walk[:2])
    step = 0.25 * config.period * wanted + np.sqrt(0.46 / GRAVITY) * (v - wanted)
    swinging = np.flatnonzero(robot.gait.swings)
    assert len(swinging) == 2
    for k in swinging:
        phase = (state["phase"] + robot.gait.offset[k]) % 1.0
        left = (1.0 - phase) * config.period
        goal = com + left * v + QUADRUPED[k, :2] + step
        np.testing.assert_allclose(robot.gait.goal[k], goal, atol=1e-9)
    np.testing.assert_array_equal(plan.footstep, robot.gait.goal[swinging[-1]])


def test_a_foothold_is_within_reach_of_its_hip():
    robot = moving(quadruped, TROT)
    robot.v[:2] = 4.0, 3.0
    ask(robot, (*TROT, 0))
    for k in np.flatnonzero(robot.gait.swings):
        phase = (robot.gait.state["phase"][0] + robot.gait.offset[k]) % 1.0
        hip = robot.measured.com[:2] + QUADRUPED[k, :2]
        hip = hip + (1.0 - phase) * TrotConfig().period * robot.v[:2]
        assert np.linalg.norm(robot.gait.goal[k] - hip) == pytest.approx(0.38)


@pytest.mark.parametrize(
    ("slip", "speed", "steps"),
    [(0.0, 0.0, False), (0.14, 0.0, False), (0.16, 0.0, True), (0.0, 0.26, True)],
)
def test_a_trot_steps_by_itself_where_a_foot_slips_or_it_is_pushed(slip, speed, steps):
    robot = standing(quadruped(), velocity=(speed, 0.0))
    robot.measured.slip[2] = slip
    ask(robot)
    state = robot.gait.state[0]
    assert (state["mode"] == Mode.STEP) == steps
    assert state["until"] == pytest.approx(state["time"] + 2.0 if steps else 0.0)
    fixed = standing(quadruped(recover=False), velocity=(speed, 0.0))
    fixed.measured.slip[2] = slip
    ask(fixed)
    assert fixed.gait.state["mode"][0] == Mode.STAND


def test_the_margin_is_the_distance_of_the_capture_point_from_the_box_of_feet():
    robot = standing(quadruped(), at=(0.05, 0.0), velocity=(0.0, -0.1))
    time = np.sqrt(0.46 / GRAVITY)
    expected = min(0.3 - 0.05, 0.2 - 0.1 * time)
    assert ask(robot).margin[0] == pytest.approx(expected, abs=1e-9)


def moved(points, yaw, shift):
    R = np.eye(3)
    R[:2, :2] = heading_axes(yaw)
    return points @ R.T + shift


class Elsewhere(Pendulum):
    """The same robot at another place, height and heading."""

    def __init__(self, planner, config, feet, soles, height, yaw, shift):
        super().__init__(planner, config, moved(feet, yaw, shift), soles, height)
        from wbc_suite.locomotion import begin_gait

        self.measured.com[:] = moved(np.array([0.0, 0.0, height]), yaw, shift)
        self.measured.foot_yaw[:] = yaw
        begin_gait(self.gait, self.measured, yaw)

    def run(self, seconds, walk=(0.0, 0.0, 0.0), height=0.0, push=(0.0, 0.0)):
        """Advance; feet do not sink below the ground of this place."""
        command, state = np.array([*walk, height]), self.gait.state[0]
        ground = self.measured.foot[:, 2].min()
        for _ in range(round(seconds / DT)):
            swings = self.gait.swings.copy()
            self.planner(self.gait, self.measured, command, DT, self.plan)
            for k in np.flatnonzero(self.gait.swings):
                self.measured.foot[k] = self.plan.position[k]
                self.measured.foot[k, 2] = max(self.measured.foot[k, 2], ground)
                self.measured.foot_yaw[k] = self.plan.yaw[k]
            for k in np.flatnonzero((self.gait.swings == 0) & (swings == 1)):
                self.measured.foot[k, 2] = ground
            self.v += DT * self.plan.com_acceleration
            self.measured.com[:] += DT * self.v
        return state


@pytest.mark.parametrize("walk", [(0.3, -0.1, 0.2), (-0.2, 0.1, 0.0)])
@pytest.mark.parametrize("gait", ["walk", "trot"])
def test_a_gait_is_the_same_at_another_place_and_heading(gait, walk):
    kinds = {
        "walk": (plan_walk, WalkConfig(), BIPED, np.array([SOLE, SOLE]), 0.8),
        "trot": (plan_trot, TrotConfig(), QUADRUPED, np.zeros((4, 4)), 0.46),
    }
    yaw, shift = 1.1, np.array([2.0, -3.0, 0.7])
    here = Elsewhere(*kinds[gait], 0.0, np.zeros(3))
    there = Elsewhere(*kinds[gait], yaw, shift)
    for robot in (here, there):
        state = robot.run(1.5, walk)
        assert state["steps"] > 1
    np.testing.assert_allclose(
        moved(here.measured.foot, yaw, shift), there.measured.foot, atol=1e-6
    )
    com = moved(here.measured.com, yaw, shift)
    np.testing.assert_allclose(com, there.measured.com, atol=1e-6)
    np.testing.assert_allclose(here.plan.load, there.plan.load, atol=1e-9)
    assert here.plan.margin[0] == pytest.approx(there.plan.margin[0], abs=1e-6)


def test_a_command_is_approached_with_the_acceleration_of_the_config():
    for robot, rate in ((biped(), 0.4), (quadruped(), 1.0)):
        robot.run(0.1, (0.5, -0.5, 0.3), height=-0.1)
        state = robot.gait.state[0]
        expected = rate * 0.1 * np.array([1.0, -1.0, 1.0])
        np.testing.assert_allclose(state["velocity"], expected, atol=1e-9)
        sunk = state["height"] - state["nominal_height"]
        assert sunk == pytest.approx(-0.15 * 0.1)
        assert state["time"] == pytest.approx(0.1)


def test_diagonal_feet_have_the_same_phase():
    np.testing.assert_array_equal(quadruped().gait.offset, [0.0, 0.5, 0.5, 0.0])


@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_a_point_is_kept_in_one_sole_or_in_the_box_of_both(yaw):
    robot = biped(margin=0.01)
    R = heading_axes(yaw)
    robot.measured.foot[:, :2] = BIPED[:, :2] @ R.T
    robot.measured.foot_yaw[:] = yaw
    for foot, low, high in (
        (0, [-0.08, 0.08], [0.08, 0.12]),
        (1, [-0.08, -0.12], [0.08, -0.08]),
        (-1, [-0.08, -0.12], [0.08, 0.12]),
    ):
        for own in ([0.0, 0.0], [0.2, 0.11], [-0.03, -0.3], [0.05, 0.09]):
            out = np.empty(2)
            margin = keep_in_soles(robot.gait, robot.measured, R @ own, foot, out)
            np.testing.assert_allclose(R.T @ out, np.clip(own, low, high), atol=1e-12)
            inside = min(np.min(np.subtract(own, low)), np.min(np.subtract(high, own)))
            assert margin == pytest.approx(inside)
