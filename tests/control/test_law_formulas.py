"""Kernels of laws as plain Python, against the formulas that they state."""

from types import SimpleNamespace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.compiling import plain
from wbc_suite.control.contact import feet_tick as solve_tick
from wbc_suite.control.contact import terms
from wbc_suite.control.ground import acceleration_limits as limits
from wbc_suite.control.ground.records import LawKind, LawRecord
from wbc_suite.control.ik import commanded_scene
from wbc_suite.control.ik import plan_triggers as progress
from wbc_suite.control.ik.plan_triggers import (
    PROGRESS,
    PROGRESS_TIME,
    PROGRESS_WINDOW,
    STANDSTILL,
    STUCK_AFTER,
    TRAIL,
    TRAIL_STEP,
    Event,
    Trail,
    record_state,
    watch_progress,
)
from wbc_suite.control.ik.report import contacts_of
from wbc_suite.control.law import osc
from wbc_suite.control.part.joint_controllers import JointPositionController
from wbc_suite.control.part.osc_controller import OscConfig
from wbc_suite.control.poses import pose_vector
from wbc_suite.control.run import motor_commands as inverse_dynamics
from wbc_suite.control.walking.whole_body_id import WholeBodyID


def record(**fields):
    return SimpleNamespace(**fields)


class TestAccelerationLimits:
    """v' <= r (u(d) - v) - u'(d) v, with u(d) as the docstring states it."""

    b, fastest, low, high = 20.0, 2.0, -1.0, 1.5

    def allowed(self, d):
        """Return u(d)."""
        if d <= 0.0:
            return max(limits.RATE * d, -self.fastest)
        corner = self.b / limits.RATE
        braking = np.sqrt(2.0 * self.b * d + corner**2) - corner
        return min(braking, self.fastest)

    def greatest(self, d, v):
        h = 1e-7
        slope = (self.allowed(d + h) - self.allowed(d - h)) / (2.0 * h)
        return limits.RATE * (self.allowed(d) - v) - slope * v

    def found(self, q, v):
        physics = record(qpos=np.array([q]), qvel=np.array([v]))
        drive = record(
            qpos=0,
            dof=0,
            position_min=self.low,
            position_max=self.high,
            velocity_max=self.fastest,
            deceleration=self.b,
        )
        return plain(limits.acceleration_limits)(physics, drive)

    @pytest.mark.parametrize("v", [-3.0, -1.9, -0.3, 0.0, 0.4, 1.7, 2.5])
    @pytest.mark.parametrize(
        "q",
        [-1.3, -1.01, -0.999, -0.9, -0.6, 0.0, 1.2, 1.3, 1.35, 1.4, 1.49, 1.51, 2.0],
    )
    def test_they_are_those_of_the_curve(self, q, v):
        lower, upper = self.found(q, v)
        assert upper == pytest.approx(self.greatest(self.high - q, v), rel=1e-4)
        assert lower == pytest.approx(-self.greatest(q - self.low, -v), rel=1e-4)

    def test_a_joint_on_the_curve_stops_at_its_limit_in_time(self):
        q, v, dt = 0.0, 2.0, 1e-3
        for _ in range(2000):
            v += dt * self.found(q, v)[1]
            q += dt * v
        assert q == pytest.approx(self.high, abs=2e-3)
        assert v == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize(
    ("trust", "ticks", "share"), [(1.0, 5, 1.0), (0.3, 0, 1.0), (0.3, 5, 0.3)]
)
def test_velocities_are_predicted_and_corrected_by_the_trust(
    trust, ticks, share, monkeypatch
):
    """Before the first tick, or with full trust, they are those that were measured."""
    monkeypatch.setattr(terms, "write_inertia", lambda *_: None)
    measured, before, a = np.arange(7.0), np.full(7, 2.0), np.linspace(-1.0, 1.0, 7)
    found = record(M=None, v=before.copy(), a=a, h=np.zeros(7))
    state = record(is_free=1, trust=trust, ticks=ticks, dt=0.1)
    physics = record(qvel=measured, qfrc_bias=np.ones(7), qfrc_passive=np.arange(7.0))
    plain(terms.write_terms)(
        physics, record(terms=found, dofs=np.arange(7), state=[state])
    )
    predicted = before + 0.1 * a
    np.testing.assert_allclose(found.v, predicted + share * (measured - predicted))
    np.testing.assert_allclose(found.h, 1.0 - np.arange(7.0))


def test_joints_of_a_robot_that_fell_are_held_by_a_spring_and_a_damper():
    posture, q, v = np.array([0.3, -0.2]), np.array([0.1, 0.5]), np.array([0.4, -0.1])
    qp = record(x=np.full(5, 9.0))
    body = record(
        qp=qp,
        terms=record(B=np.zeros((3, 8)), v=np.array([*np.zeros(6), *v])),
        load=np.ones(2),
        qpos=np.array([1, 0]),
        posture=posture,
        state=[record(ticks=4, stage=0)],
    )
    plain(solve_tick._hold_joints)(record(qpos=q[::-1]), body)
    np.testing.assert_allclose(qp.x[:3], 0.0)
    np.testing.assert_allclose(qp.x[3:], 100.0 * (posture - q) - 40.0 * v)
    np.testing.assert_array_equal(body.load, 0.0)
    assert body.state[0].ticks == 5


CONTACTS = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 .1"/>
    <body name="robot0_foot" pos="0 0 0.09"><freejoint/>
      <geom name="sole" type="sphere" size=".1" mass="1"/></body>
    <body name="cube" pos="0 0 0.28"><freejoint/>
      <geom name="box" type="sphere" size=".1" mass="2"/></body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize("prefix", ["robot0_", "other_"])
def test_contacts_are_those_of_the_robots_links(prefix):
    model = mujoco.MjModel.from_xml_string(CONTACTS)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = contacts_of(record(model=model, data=data, prefix=prefix))
    if prefix == "other_":
        assert found == []
        return
    assert {(contact.link, contact.other) for contact in found} == {
        ("foot", "floor"),
        ("foot", "cube"),
    }
    forces = [contact.force for contact in found]
    assert forces == sorted(forces, reverse=True)
    state = record(model=model, data=data, prefix=prefix)
    assert contacts_of(state, except_links=["foot"]) == []


class TestProgress:
    """When a planner is asked: far goals, a standstill, an approach that creeps."""

    dt = 0.01

    @pytest.fixture(autouse=True)
    def _frames_are_measured(self, monkeypatch):
        monkeypatch.setattr(progress, "measure_frames", lambda *_: None)

    def progress(self, **state):
        size = round(PROGRESS_WINDOW / self.dt) + 1
        made = record(
            state=[record(**dict.fromkeys(PROGRESS.names, 0))],
            error=np.zeros(size),
            trail_time=np.zeros(TRAIL),
            trail_q=np.zeros((TRAIL, 2)),
            trail_v=np.zeros((TRAIL, 2)),
            far=np.array([0.3, 0.5]),
            may_plan=True,
            dt=self.dt,
        )
        made.state[0].__dict__.update(state)
        return made

    def event(self, made, *, away=(0.1, 0.1), level=0, speed=0.0):
        frames = record(
            level=np.array([level]),
            distance=np.array([away]),
            tolerance=np.array([0.01, 0.02]),
        )
        v = np.array([speed, -0.5 * speed])
        return Event(plain(watch_progress)(made, None, frames, v))

    def test_events_are_distinct(self):
        assert len({event.value for event in Event}) == len(list(Event)) == 5
        assert not Event.NONE

    @pytest.mark.parametrize(
        ("away", "level", "is_planning", "event"),
        [
            ((0.31, 0.0), 0, 0, Event.FAR_GOALS),
            ((0.0, 0.51), 0, 0, Event.FAR_GOALS),
            ((0.31, 0.51), 1, 0, Event.NONE),
            ((0.29, 0.49), 0, 0, Event.NONE),
            ((0.29, 0.49), 0, 1, Event.NEW_GOALS),
        ],
    )
    def test_new_goals(self, away, level, is_planning, event):
        progress = self.progress(
            goals_changed=1, is_planning=is_planning, has_searched=1, errors=7
        )
        assert self.event(progress, away=away, level=level) is event
        state = progress.state[0]
        assert (state.goals_changed, state.has_searched, state.errors) == (0, 0, 0)

    def test_a_robot_that_stands_for_0_1_s_short_of_its_goals_is_stuck(self):
        progress, found = self.progress(), []
        for _ in range(13):
            found.append(self.event(progress, speed=0.9 * STANDSTILL))
        assert STUCK_AFTER == 0.1
        assert found == [Event.NONE] * 10 + [Event.STUCK] * 3
        assert self.event(progress, away=(0.009, 0.019)) is Event.NONE
        assert self.event(progress, speed=1.1 * STANDSTILL) is Event.NONE
        progress.state[0].has_searched = 1
        progress.state[0].standstill = 1.0
        assert self.event(progress) is Event.NONE
        progress.state[0].is_planning = 1
        assert self.event(progress) is Event.PLANNING

    @pytest.mark.parametrize(("rest", "stuck"), [(0.89, False), (0.91, True)])
    def test_an_approach_that_takes_longer_than_2_s_is_stuck(self, rest, stuck):
        """Less than 1/10 of the error in 1/10 of that time."""
        assert (PROGRESS_WINDOW, PROGRESS_TIME) == (0.2, 2.0)
        progress = self.progress(errors=21)
        progress.error[:] = np.linspace(1.0, rest, 21)
        event = self.event(progress, speed=1.0)
        assert event is (Event.STUCK if stuck else Event.NONE)
        progress.state[0].errors = 20
        assert self.event(progress, speed=1.0) is Event.NONE

    def test_without_a_planner_nothing_happens(self):
        progress = self.progress(goals_changed=1)
        progress.may_plan = False
        assert self.event(progress, away=(9.0, 9.0)) is Event.NONE

    def test_the_trail_keeps_every_fifth_state_the_latest_first(self):
        progress = self.progress()
        for k in range(1, 1001):
            progress.state[0].solves = k
            robot = record(q=np.array([k, -k]))
            plain(record_state)(progress, robot, np.array([2.0 * k, 0.0]))
        progress.state = {"recorded": [progress.state[0].recorded]}
        trail = Trail(progress)
        assert TRAIL_STEP == 5
        assert len(trail) == TRAIL
        for k in range(TRAIL):
            solve = 1000 - 5 * k
            assert trail[k].time == pytest.approx(solve * self.dt)
            np.testing.assert_array_equal(trail[k].q, [solve, -solve])
            np.testing.assert_array_equal(trail[k].v, [2.0 * solve, 0.0])
        with pytest.raises(IndexError):
            trail[TRAIL]


def test_osc_adds_the_way_to_its_goal_to_what_its_posture_asks_for(monkeypatch):
    n = 7
    for name in ("write_hand_task", "solve_lower", "lq_solve", "solve_upper"):
        monkeypatch.setattr(osc, name, lambda *_: None)
    monkeypatch.setattr(osc, "_write_damped_factors", lambda *_: None)
    work = record(
        J=np.zeros((6, n)),
        C=np.eye(n),
        wanted=np.zeros(6),
        pull=np.zeros(6),
        posture=np.arange(7.0),
        z=np.full(n, 2.0),
        L=np.eye(6),
        Q=np.zeros((6, n + 6)),
        column=np.zeros(n),
        dofs=np.arange(n)[::-1],
    )
    physics = record(osc=work, acceleration=np.zeros(n))
    plain(osc.osc_law)(physics, record(first=0, last=n, turn_weight=1.0), None)
    np.testing.assert_array_equal(physics.acceleration[::-1], np.arange(7.0) + 2.0)


@pytest.mark.parametrize("asked", [0.0, 1.0])
@pytest.mark.parametrize("saturated", [False, True])
def test_hands_come_last_and_keep_their_direction_where_they_are_asked_to(
    asked, saturated, monkeypatch
):
    """And accelerations are limited in any case, last."""
    called = []

    def note(*words):
        return lambda *_: called.append(" ".join(words))

    monkeypatch.setattr(inverse_dynamics, "is_saturated", lambda *_: saturated)
    monkeypatch.setattr(inverse_dynamics, "limit_accelerations", note("limit"))
    laws = LawRecord.zeros(3)
    laws["kind"] = LawKind.OSC, LawKind.JOINT, LawKind.TORQUE
    laws["kernel"], laws["keep_direction"] = (1, 2, 0), (asked, 0.0, 0.0)
    kernels = record(
        observe_roots=note("roots"),
        observe=note("observe"),
        law=(note("none"), note("hand"), note("joints")),
        prepare=note("prepare"),
        keep_direction=note("direction"),
    )
    physics = record(acceleration=np.ones(2), timestep=0.002)
    loop = record(physics=physics, laws=laws, drives=None)
    plain(inverse_dynamics.ask_accelerations)(loop, kernels)
    kept = ["prepare", "direction"] * (saturated and asked > 0.0)
    assert called == ["roots", "observe", "joints", "limit", "hand", *kept, "limit"]
    np.testing.assert_array_equal(laws["since"], 0.002)
    assert not physics.acceleration.any()


def test_the_commanded_scene_has_the_commanded_joints_and_the_measured_rest(
    monkeypatch,
):
    called = []
    monkeypatch.setattr(
        commanded_scene, "mj_kinematics", lambda *given: called.append(given)
    )
    scene = record(
        measured=np.arange(6.0),
        qpos=np.zeros(6),
        measured_mocap_pos=np.arange(6.0).reshape(2, 3),
        mocap_pos=np.zeros((2, 3)),
        measured_mocap_quat=np.arange(8.0).reshape(2, 4),
        mocap_quat=np.zeros((2, 4)),
        joint=np.array([1, 0]),
        place=np.array([4, 2]),
        q=np.array([10.0, 20.0]),
        model=1,
        data=2,
    )
    plain(commanded_scene.place_commanded)(scene)
    np.testing.assert_array_equal(scene.qpos, [0, 1, 10, 3, 20, 5])
    np.testing.assert_array_equal(scene.mocap_pos, scene.measured_mocap_pos)
    np.testing.assert_array_equal(scene.mocap_quat, scene.measured_mocap_quat)
    assert called == [(1, 2)]


def test_joints_whose_step_is_zero_keep_their_goals():
    """Also where the others start from where they are."""
    goal, q = np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.5, 0.6])
    for mode, start in (("target", goal), ("achieved", q)):
        part = record(
            goal=goal.copy(),
            config=record(goal_update_mode=mode),
            law=record(drives={"qpos": np.arange(3)}),
            _state=record(data=record(qpos=q)),
            _input=record(clip=lambda x: np.minimum(x, 0.55)),
        )
        JointPositionController._step(part, np.array([0.05, 0.0, 0.2]))
        expected = [start[0] + 0.05, 0.2, min(start[2] + 0.2, 0.55)]
        np.testing.assert_allclose(part.goal, expected)


def test_poses_have_six_values_and_positions_three():
    for kind, size in (("OSC_POSE", 6), ("OSC_POSITION", 3)):
        config = OscConfig(type=kind)
        assert config.size == size
        low, high = config.outputs()
        assert (np.size(low), np.size(high)) == (size, size)
        np.testing.assert_allclose(low, np.negative(high))


@pytest.mark.parametrize(
    ("since", "duration", "phase", "rate"),
    [
        (0.0, 0.0, 1.0, 0.0),
        (0.1, 0.4, 0.25, 2.5),
        (0.4, 0.4, 1.0, 2.5),
        (0.5, 0.4, 1, 0),
    ],
)
def test_the_goal_of_a_hand_moves_at_constant_velocities(since, duration, phase, rate):
    start, body = pin.SE3.Random(), pin.SE3.Random()
    shift, turn = np.array([0.3, -0.2, 0.1]), np.array([0.2, 0.5, -0.4])
    law = record(
        since=since,
        duration=duration,
        start=pose_vector(start),
        shift=shift,
        turn=turn,
    )
    R, p, twist = np.full((3, 3), 7.0), np.full(3, 7.0), np.full(6, 7.0)
    axes, place = body.rotation.copy(), body.translation.copy()
    osc.interpolate_pose(law, axes, place, R, p, twist)
    moved = pin.SE3(
        start.rotation @ pin.exp3(phase * turn), start.translation + phase * shift
    )
    goal = body * moved
    np.testing.assert_allclose(R, goal.rotation, atol=1e-12)
    np.testing.assert_allclose(p, goal.translation, atol=1e-12)
    np.testing.assert_allclose(twist[:3], rate * body.rotation @ shift, atol=1e-12)
    spin = rate * body.rotation @ start.rotation @ turn
    np.testing.assert_allclose(twist[3:], spin, atol=1e-12)


class TestActionsOfWholeBodyDynamics:
    """`WHOLE_BODY_ID` hands its action to goals, references, base and commands."""

    def controller(self):
        goals = np.zeros((2, 12))
        goals[:, [0, 5, 10]] = 1.0  # rotation and position, by rows of (3, 4)
        self.calls = []
        slices = {"walk": slice(0, 3), "height": slice(3, 4), "grip": slice(4, 5)}
        gripper = record(
            name="grip", set_goal=lambda *given: self.calls.append(("grip", *given))
        )
        return record(
            _goals=record(set=lambda action: self.calls.append("goals")),
            _time_references=lambda period: self.calls.append(("references", period)),
            _base=None,
            layout=slices,
            config=record(
                feet=("left", "right"),
                frames=[record(max_linear_speed=0.5, max_angular_speed=2.0)] * 2,
            ),
            dynamics=record(
                command=np.zeros(4),
                start=np.zeros((2, 12)),
                reference=goals.copy(),
                goal=goals.copy(),
                travel=np.full((2, 2), 9.0),
            ),
            _grippers=[gripper],
        )

    def test_an_action_sets_all_that_it_names(self):
        made, action = self.controller(), np.arange(1.0, 6.0)
        WholeBodyID.set_goal(made, action, 0.1)
        assert self.calls[:2] == ["goals", ("references", 0.1)]
        name, grip, period = self.calls[2]
        assert (name, grip.tolist(), period) == ("grip", [5.0], 0.1)
        np.testing.assert_array_equal(made.dynamics.command, [1.0, 2.0, 3.0, 4.0])

    @pytest.mark.parametrize(
        ("way", "turn", "time"),
        [(0.0, 0.0, 0.05), (0.2, 0.0, 0.4), (0.0, 1.0, 0.5), (0.2, 1.0, 0.5)],
    )
    def test_references_travel_no_faster_than_they_may(self, way, turn, time):
        made = self.controller()
        goal = pin.SE3(pin.exp3(np.array([0.0, turn, 0.0])), np.array([0.0, way, 0.0]))
        made.dynamics.goal[1] = np.column_stack(
            [goal.rotation, goal.translation]
        ).ravel()
        WholeBodyID._time_references(made, 0.05)
        np.testing.assert_array_equal(made.dynamics.start, made.dynamics.reference)
        np.testing.assert_allclose(made.dynamics.travel, [[0.0, 0.05], [0.0, time]])
