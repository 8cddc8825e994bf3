"""What a robot and an operator may do to a stack: no exception, no flutter, a reason.

The cases are those on which differential inverse kinematics is known to fail:
unreachable targets, jumps, starts outside limits, a straight arm pulled in and pushed
out, conflicting tasks, rows that contradict each other, targets that are not finite.
"""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    ComTask,
    Conflict,
    Fallback,
    FrameEquality,
    FrameTask,
    LinearEquality,
    LookAtTask,
    OutOfReach,
    PostureTask,
    RelativeFrameTask,
    TargetNotFinite,
    TaskStack,
    fallback,
)
from wbc_suite.qp.solver import QpsolversSolver

DT = 5e-3
CHATTER = 0.01  # rad/s, p99 of the change of velocity between ticks, last second
FEET = ("rleg_wrist2_joint", "lleg_wrist2_joint")
HANDS = ("rarm_wrist2_joint", "larm_wrist2_joint")
STRAIGHT = np.array([0.0, 0.3, 0.0, -0.07, 0.0, 0.4, 0.8])


def arm_stack(arm, level=0, **options):
    tasks = [FrameTask("hand"), PostureTask(1e-2, level=level)]
    return TaskStack(arm, tasks, **options)


def humanoid_stack(humanoid, level=0):
    hands = [FrameTask(name) for name in HANDS]
    feet = [FrameEquality(name) for name in FEET]
    tasks = [*hands, ComTask(), PostureTask(1e-2, level=level)]
    return TaskStack(humanoid, tasks, equalities=feet)


def shift(task, offset):
    target = task.target
    target.translation = target.translation + np.asarray(offset)
    task.set_target(target)


def words(report):
    return [str(reason) for reason in report.reasons]


def run(stack, seconds, dt=DT):
    """Tick, check every command against the limits, return solution and chatter."""
    robot, model = stack.configuration, stack.configuration.model
    bounded = model.upperPositionLimit < 1e10
    lower, upper = model.lowerPositionLimit[bounded], model.upperPositionLimit[bounded]
    outside = [
        max(0.0, float((robot.q[bounded] - upper).max(initial=0.0))),
        max(0.0, float((lower - robot.q[bounded]).max(initial=0.0))),
    ]
    speeds = np.where(model.velocityLimit > 0, model.velocityLimit, np.inf)
    history = []
    for _ in range(round(seconds / dt)):
        solution = stack.solve(dt)
        assert np.isfinite(solution.dq).all()
        assert (np.abs(solution.v[6:]) <= speeds[6:] + 1e-9).all()
        robot.update(robot.integrate(solution.dq))
        q = robot.q[bounded]
        assert (q - upper).max(initial=0.0) <= outside[0] + 1e-9
        assert (lower - q).max(initial=0.0) <= outside[1] + 1e-9
        history.append(solution.v)
    changes = np.abs(np.diff(history, axis=0)).max(axis=1)
    return solution, float(np.percentile(changes[-round(1.0 / dt) :], 99))


@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("dt", [2e-3, 5e-3, 2e-2, 5e-2])
def test_arm_stands_still_before_an_unreachable_target(arm, level, dt):
    stack = arm_stack(arm, level)
    shift(stack.tasks[0], [2.0, 0.5, 0.0])
    solution, chatter = run(stack, 6.0, dt)
    assert solution.ok
    assert chatter <= CHATTER
    report = stack.explain()["hand"]
    assert not report.reached
    assert report.position_error > 1.0
    assert isinstance(report.reasons[0], OutOfReach)


@pytest.mark.slow
@pytest.mark.parametrize("level", [0, 1])
def test_humanoid_stands_still_before_an_unreachable_target(humanoid, level):
    stack = humanoid_stack(humanoid, level)
    shift(stack.tasks[0], [6.0, 0.0, 0.0])
    _, chatter = run(stack, 8.0)
    assert chatter <= CHATTER
    report = stack.explain()[HANDS[0]]
    assert not report.reached
    assert report.reasons


def test_a_jump_of_one_metre_is_reached_without_flutter(arm):
    arm.update(np.array([-1.0, 0.4, 0.0, -1.5, 0.0, 1.9, 0.8]))
    stack = arm_stack(arm, level=1)
    task = stack.tasks[0]
    target, turn = pin.SE3(task.target), pin.exp3(np.array([0.0, 0.0, 2.0]))
    target.translation = turn @ target.translation  # about the arm's vertical axis
    target.rotation = turn @ target.rotation
    assert np.linalg.norm(target.translation - task.target.translation) >= 1.0
    task.set_target(target)
    _, chatter = run(stack, 6.0)
    assert chatter <= CHATTER
    assert np.linalg.norm(task.error(arm)) < 1e-4


@pytest.mark.parametrize("outside", [1e-3, 0.05, 0.1])
def test_a_joint_outside_its_limits_returns_at_full_speed(arm, outside):
    model = arm.model
    q = arm.q.copy()
    q[1] = model.upperPositionLimit[1] + outside
    q[5] = model.lowerPositionLimit[5] - outside
    arm.update(q)
    stack = arm_stack(arm)
    full = 2.175 * DT  # joint 2 at its velocity limit
    for _ in range(int(np.ceil(outside / full))):
        before = arm.q.copy()
        solution = stack.solve(DT)
        assert solution.ok
        arm.update(arm.integrate(solution.dq))
        left = before[1] - model.upperPositionLimit[1]
        if left > full:
            assert before[1] - arm.q[1] == pytest.approx(full, abs=1e-9)
        assert arm.q[1] < before[1]
        assert arm.q[5] > before[5]
    assert arm.q[1] <= model.upperPositionLimit[1] + 1e-9
    _, chatter = run(stack, 3.0)
    assert chatter <= CHATTER


@pytest.mark.parametrize("level", [0, 1])
def test_a_straight_arm_pulled_in_gets_there(arm, level):
    arm.update(STRAIGHT)
    stack = arm_stack(arm, level)
    task = stack.tasks[0]
    along = task_direction(stack)
    shift(task, -0.25 * along)
    run(stack, 0.6)
    assert "joint limit: joint4 (upper)" in words(stack.explain()["hand"])
    _, chatter = run(stack, 6.0)
    assert chatter <= CHATTER
    assert np.linalg.norm(task.error(arm)[:3]) < 1e-3
    assert stack.explain()["hand"].reached


@pytest.mark.parametrize("level", [0, 1])
def test_a_straight_arm_pushed_out_stands_still(arm, level):
    arm.update(STRAIGHT)
    stack = arm_stack(arm, level)
    shift(stack.tasks[0], 0.25 * task_direction(stack))
    _, chatter = run(stack, 6.0)
    assert chatter <= CHATTER
    assert isinstance(stack.explain()["hand"].reasons[0], OutOfReach)


def task_direction(stack):
    arm = stack.configuration.frame_pose("hand").translation - [0.0, 0.0, 0.333]
    return arm / np.linalg.norm(arm)


@pytest.mark.slow
@pytest.mark.parametrize("level", [0, 1])
def test_hands_pulled_apart_stand_still_and_are_told(humanoid, level):
    stack = humanoid_stack(humanoid, level)
    shift(stack.tasks[0], [0.0, -4.0, 0.0])
    shift(stack.tasks[1], [0.0, 4.0, 0.0])
    _, chatter = run(stack, 8.0)
    assert chatter <= CHATTER
    assert all(stack.explain()[name].reasons for name in HANDS)


def test_conflicting_tasks_are_named(arm):
    one, two = FrameTask("hand", name="one"), FrameTask("hand", name="two")
    stack = TaskStack(arm, [one, two])
    shift(one, [0.0, 0.2, 0.0])
    shift(two, [0.0, -0.2, 0.0])
    _, chatter = run(stack, 4.0)
    assert chatter <= CHATTER
    assert Conflict("two") in stack.explain()["one"].reasons
    assert Conflict("one") in stack.explain()["two"].reasons


@pytest.mark.slow
def test_contradicting_rows_are_relaxed_and_named(arm):
    row = np.eye(7)[:1]
    stack = arm_stack(
        arm,
        equalities=[
            LinearEquality(row, name="stand"),
            LinearEquality(row, rate=np.array([0.5]), name="go"),
        ],
    )
    solution, chatter = run(stack, 2.0)
    assert solution.fallback is Fallback.SLACK
    assert set(solution.conflicts) == {"stand", "go"}
    assert chatter <= CHATTER


@pytest.mark.slow
def test_rows_against_the_joint_limits_are_relaxed(arm):
    rows = LinearEquality(np.eye(7)[:1], rate=np.array([9.0]), name="too fast")
    solution, chatter = run(arm_stack(arm, equalities=[rows]), 4.0)
    assert solution.fallback is Fallback.SLACK
    assert solution.conflicts == ("too fast",)
    assert chatter <= CHATTER


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("entry", [(0, 3), (0, 0)])
def test_a_target_that_is_not_finite_holds_the_hand(arm, bad, entry):
    stack = arm_stack(arm)
    task = stack.tasks[0]
    start = arm.frame_pose("hand")
    target = task.target.homogeneous
    good = target.copy()
    target[entry] = bad
    task.set_target(target)
    solution, chatter = run(stack, 2.0)
    assert solution.held == ("hand",)
    assert not solution.ok
    assert chatter <= CHATTER
    moved = arm.frame_pose("hand").translation - start.translation
    assert np.linalg.norm(moved) < 1e-3
    assert stack.explain()["hand"].reasons == (TargetNotFinite(),)
    good[2, 3] += 0.05
    task.set_target(good)
    solution, _ = run(stack, 2.0)
    assert solution.ok
    assert np.linalg.norm(task.error(arm)[:3]) < 1e-4


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_other_targets_that_are_not_finite_hold_what_they_watch(humanoid, bad):
    look = LookAtTask("head2_joint")
    relative = RelativeFrameTask(*HANDS)
    foot = FrameEquality(FEET[0])
    stack = TaskStack(humanoid, [look, relative, PostureTask(1e-2)], equalities=[foot])
    look.set_target(np.array([bad, 0.0, 0.0]))
    pose = np.eye(4)
    pose[0, 3] = bad
    relative.set_target(pose)
    foot.set_target(pose)
    before = humanoid.frame_pose(FEET[0]).translation
    solution, chatter = run(stack, 1.0)
    assert set(solution.held) == {look.name, relative.name}
    assert chatter <= CHATTER
    moved = humanoid.frame_pose(FEET[0]).translation - before
    assert np.linalg.norm(moved) < 1e-3
    pose[0, 3] = 1e200
    relative.set_target(pose)
    look.set_target(pose[:3, 3])
    run(stack, 0.1)


def test_posture_and_com_that_are_not_finite_are_held(humanoid):
    stack = humanoid_stack(humanoid)
    com, posture = stack.tasks[2], stack.tasks[3]
    com.set_target(np.array([np.nan, 0.0, 0.0]))
    posture.set_target(np.full(humanoid.nq, np.inf))
    solution, chatter = run(stack, 1.0)
    assert set(solution.held) == {"com", "posture"}
    assert chatter <= CHATTER


def test_a_measured_position_that_is_not_finite_holds_still(arm):
    stack = arm_stack(arm)
    q = arm.q.copy()
    q[2] = np.nan
    arm.update(q)
    solution = stack.solve(DT)
    np.testing.assert_array_equal(solution.dq, 0.0)
    assert solution.fallback is Fallback.HOLD


class Liar:
    """A solver that answers nonsense."""

    def solve(self, problem):
        return np.full(problem.nv, np.nan), np.zeros(len(problem.upper))

    def fresh(self):
        return self


@pytest.mark.parametrize("all_lie", [False, True])
def test_a_solver_that_answers_nonsense_is_not_believed(arm, monkeypatch, all_lie):
    """Daqp takes its place; if that lies too, coordinate descent does."""
    stack = arm_stack(arm, warm=False)
    shift(stack.tasks[0], [0.0, 0.1, 0.0])
    stack._level_solver.solver = Liar()
    if all_lie:
        monkeypatch.setattr(fallback, "DaqpSolver", Liar)
    before = np.linalg.norm(stack.tasks[0].error(arm))
    solution, _ = run(stack, 2.0)
    assert solution.fallback is (Fallback.BOX if all_lie else Fallback.NONE)
    assert np.linalg.norm(stack.tasks[0].error(arm)) < 0.1 * before


@pytest.mark.slow
def test_a_slow_solver_is_asked_once_a_tick(arm, monkeypatch):
    """Daqp solves fallbacks and what `escape` simulates."""
    row, calls = np.eye(7)[:1], []
    equalities = [LinearEquality(row), LinearEquality(row, rate=np.array([0.5]))]
    stack = arm_stack(arm, equalities=equalities, solver="proxqp")
    shift(stack.tasks[0], [2.0, 0.0, 0.0])
    solve = QpsolversSolver.solve
    monkeypatch.setattr(
        QpsolversSolver, "solve", lambda *x: calls.append(1) or solve(*x)
    )
    solution, chatter = run(stack, 4.0)
    assert solution.fallback is Fallback.SLACK
    assert len(calls) == round(4.0 / DT)
    assert chatter <= CHATTER


def test_stack_works_on_a_model_without_limits():
    model = pin.buildSampleModelManipulator()
    robot = Configuration(model, pin.neutral(model) + 0.3)
    frame = model.frames[model.nframes - 1].name
    stack = TaskStack(robot, [FrameTask(frame)])
    shift(stack.tasks[0], [0.05, 0.05, 0.0])
    for _ in range(400):
        robot.update(robot.integrate(stack.solve(DT).dq))
    assert np.linalg.norm(stack.tasks[0].error(robot)) < 1e-4
