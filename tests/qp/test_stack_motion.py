"""Damping that grows while a stack at rest overshoots, and why a stack moves."""

import numpy as np
import pytest

from wbc_suite.qp import (
    Approach,
    FrameTask,
    LinearEquality,
    Overshoot,
    PostureTask,
    Relaxed,
    TaskStack,
)
from wbc_suite.qp.part import STATE
from wbc_suite.qp.tick import turned

DT = 0.01


@pytest.mark.parametrize(
    ("velocities", "expected"),
    [
        ((0.1, -0.1, 0.1), True),
        ((-0.25, 0.25, -0.05), True),
        ((0.0, 0.1, 0.2), False),  # speeds up
        ((0.2, 0.1, 0.0), False),  # slows down
        ((0.1, -0.1, -0.3), False),  # turned once, and goes on
        ((0.3, 0.1, 0.3), False),  # unsteady, but onwards
        ((1e-4, -1e-4, 1e-4), False),  # stands
    ],
)
def test_a_joint_that_goes_to_and_fro_is_seen(velocities, expected):
    first, before, now = velocities
    assert turned(now, before, before - first) is expected


def swinging(arm):
    """Return a stack, and a function that ticks it with speeds to and fro."""
    stack = TaskStack(arm, [FrameTask("hand"), PostureTask(1e-2)])
    sign = [1.0]

    def tick():
        sign[0] *= -1.0
        stack.v_previous[:] = 0.2 * sign[0]
        return stack.solve(DT)

    return stack, tick


def damping(solution):
    record = solution.record
    state = record.layout.results(record.buffer)["state"].view(STATE)
    return float(state["overshoot_damping"][0])


def test_damping_grows_by_a_fifth_of_all_damping_while_targets_rest(arm):
    stack, tick = swinging(arm)
    found = [damping(tick()) for _ in range(40)]
    assert np.all(np.diff(found[2:]) > 0.0)
    assert found[-1] > 10.0 * stack.damping


def test_damping_fades_when_a_target_moves(arm):
    stack, tick = swinging(arm)
    for _ in range(40):
        grown = damping(tick())
    hand = stack.tasks[0]
    for _ in range(20):  # 0.2 s
        target = hand.target
        target.translation = target.translation + np.array([1e-3, 0.0, 0.0])
        hand.set_target(target)
        left = damping(tick())
    assert left == pytest.approx(grown * np.exp(-0.2 / 0.05), rel=1e-9)


def test_a_target_that_is_not_finite_rests(arm):
    stack, tick = swinging(arm)
    target = stack.tasks[0].target.homogeneous
    target[:3, 3] = np.nan
    stack.tasks[0].set_target(target)
    found = [damping(tick()) for _ in range(10)]
    assert found[-1] > found[-2] > 0.0


def test_reset_discards_the_damping(arm):
    stack, tick = swinging(arm)
    for _ in range(40):
        tick()
    stack.reset()
    assert damping(stack.solve(DT)) == 0.0


def test_a_stack_on_its_way_names_the_task_and_then_stands(arm):
    stack = TaskStack(arm, [FrameTask("hand"), PostureTask(1e-3)])
    hand = stack.tasks[0]
    target = hand.target
    target.translation = target.translation + np.array([0.0, 0.1, 0.0])
    hand.set_target(target)
    solution = stack.solve(DT)
    (reason,) = solution.motion
    fastest = int(np.argmax(np.abs(solution.v)))
    expected = Approach(
        "hand", f"joint{fastest + 1}", abs(solution.v[fastest]), "rad/s"
    )
    assert reason == expected
    assert str(reason) in str(solution)
    for _ in range(400):
        arm.update(arm.integrate(solution.dq))
        solution = stack.solve(DT)
    assert solution.motion == ()
    assert np.abs(solution.v).max() <= 0.005


def test_rows_that_cannot_be_kept_are_named(arm):
    row = np.eye(7)[:1]
    go = LinearEquality(row, rate=np.array([0.5]), name="go")
    stack = TaskStack(
        arm, [PostureTask(1e-2)], equalities=[go, LinearEquality(row, name="stand")]
    )
    reasons = stack.solve(DT).motion
    assert Relaxed(("go", "stand")) in reasons
    assert str(reasons[0]) == "cannot be kept: go, stand"


def test_overshoot_names_the_joint(arm):
    target = arm.q.copy()
    target[3] += 0.1
    stack = TaskStack(arm, [PostureTask(1.0, target=target)])
    for speed in (0.1, -0.1):
        stack.v_previous[3] = speed
        solution = stack.solve(DT)
    assert solution.v[3] > 0.0
    reason = solution.motion[0]
    assert isinstance(reason, Overshoot)
    assert reason.joint == "joint4"
    assert str(Overshoot("joint4", 0.02)) == "overshoot: joint4 (damping 0.02)"


def test_the_tick_that_stops_a_joint_says_so(arm):
    stack = TaskStack(arm, [PostureTask(1.0)])
    stack.v_previous[3] = 0.1
    (reason,) = stack.solve(DT).motion
    assert (reason.joint, reason.speed) == ("joint4", pytest.approx(0.0, abs=1e-9))
