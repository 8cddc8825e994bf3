"""Solutions of whole stacks: optimality and limits."""

import numpy as np
import pytest

from wbc_suite.errors import ConfigError
from wbc_suite.qp import (
    ComTask,
    FrameTask,
    LimitKind,
    PositionLimit,
    PostureTask,
    TaskStack,
)

DT = 5e-3
FEET = ("rleg_wrist2_joint", "lleg_wrist2_joint")
HANDS = ("rarm_wrist2_joint", "larm_wrist2_joint")


def humanoid_stack(configuration, **options):
    tasks = [*(FrameTask(f) for f in (*FEET, *HANDS)), ComTask(), PostureTask(1e-2)]
    return TaskStack(configuration, tasks, **options)


def move_target(task, offset):
    target = task.target
    target.translation = target.translation + np.asarray(offset)
    task.set_target(target)


def run(stack, seconds, dt=DT):
    for _ in range(round(seconds / dt)):
        solution = stack.solve(dt)
        q = stack.configuration.integrate(solution.dq)
        stack.configuration.update(q)
    return solution


def test_hand_reaches_its_target_and_feet_stay(humanoid):
    stack = humanoid_stack(humanoid)
    move_target(stack.tasks[2], [-0.1, 0.0, 0.1])
    solution = run(stack, 3.0)
    assert solution.ok
    assert np.linalg.norm(stack.tasks[2].error(humanoid)) < 5e-4
    assert np.linalg.norm(stack.tasks[0].error(humanoid)) < 5e-4


def test_solution_meets_its_kkt_conditions(humanoid, rng):
    stack = humanoid_stack(humanoid)
    for _ in range(100):
        task = stack.tasks[int(rng.integers(4))]
        move_target(task, rng.normal(size=3) * 0.3)
        solution = stack.solve(DT)
        problem, x = stack.problem(), solution.dq
        multipliers = solution.record.levels[0].multipliers
        gradient = problem.H @ x + problem.c + multipliers[: problem.nv]
        np.testing.assert_allclose(gradient, 0.0, atol=1e-10)
        at_upper, at_lower = multipliers > 0, multipliers < 0
        np.testing.assert_allclose(x[at_upper], problem.ub[at_upper], atol=1e-10)
        np.testing.assert_allclose(x[at_lower], problem.lb[at_lower], atol=1e-10)
        assert (x <= problem.ub + 1e-12).all()
        assert (x >= problem.lb - 1e-12).all()
        by_daqp, _ = stack._level_solver.solver.solve(problem)
        np.testing.assert_allclose(x, by_daqp, atol=1e-10)
        humanoid.update(humanoid.integrate(solution.dq))


def test_active_limit_is_named(arm):
    task = FrameTask("hand")
    stack = TaskStack(arm, [task, PostureTask(1e-3)])
    move_target(task, [3.0, 0.0, 0.5])
    solution = run(stack, 3.0)
    upper = [a for a in solution.active if a.kind is LimitKind.POSITION]
    assert all(
        abs(
            arm.q[int(a.name[-1]) - 1]
            - arm.model.upperPositionLimit[int(a.name[-1]) - 1]
        )
        < 1e-6
        for a in upper
        if a.side == "upper"
    )


def test_commands_keep_all_limits(arm, rng):
    task = FrameTask("hand")
    stack = TaskStack(arm, [task, PostureTask(1e-3)])
    model, v = arm.model, np.zeros(7)
    for k in range(2000):
        if k % 100 == 0:
            move_target(task, rng.normal(size=3))
        solution = stack.solve(DT)
        assert (np.abs(solution.v) <= model.velocityLimit + 1e-9).all()
        assert (np.abs(solution.v - v) <= 50.0 * DT + 1e-9).all()
        v = solution.v
        arm.update(arm.integrate(solution.dq))
        assert (arm.q <= model.upperPositionLimit + 1e-9).all()
        assert (arm.q >= model.lowerPositionLimit - 1e-9).all()


def test_reset_makes_a_stack_as_good_as_new(humanoid, rng):
    q, dt = humanoid.q.copy(), 2e-2
    stack = humanoid_stack(humanoid)
    start = [task.target for task in stack.tasks[:4]]

    def answers():
        humanoid.update(q)
        for task, target in zip(stack.tasks[:4], start, strict=True):
            task.set_target(target)
        move_target(stack.tasks[2], [2.0, 1.0, 0.0])
        found = []
        for _ in range(50):
            solution = stack.solve(dt)
            humanoid.update(humanoid.integrate(solution.dq))
            found.append(solution.v)
        return np.array(found)

    first = answers()
    for _ in range(20):
        move_target(stack.tasks[int(rng.integers(4))], rng.normal(size=3))
        humanoid.update(humanoid.integrate(stack.solve(dt).dq))
    stack.reset()
    np.testing.assert_array_equal(answers(), first)


@pytest.mark.parametrize("interval", [(1.0, -1.0), (np.nan, 1.0), (50.0, 60.0)])
def test_a_range_that_leaves_nothing_is_refused(arm, interval):
    name = arm.model.names[2]
    with pytest.raises(ConfigError, match=f"PositionLimit: .*'{name}'"):
        TaskStack(arm, [], limits=[PositionLimit(joints={name: interval})])
