"""Strict levels: what a lower level wants never moves what an upper one decided."""

import numpy as np
import pytest

from wbc_suite.errors import ConfigError
from wbc_suite.qp import ComTask, FrameTask, PostureTask, TaskStack

DT = 5e-3


def test_lower_levels_do_not_leak_into_upper_ones(humanoid, rng):
    hands = [FrameTask("rarm_wrist2_joint"), FrameTask("larm_wrist2_joint")]
    lower = [
        FrameTask("chest2_joint", level=1),
        ComTask(level=1),
        PostureTask(1.0, level=2, target=humanoid.q + 0.0),
    ]
    stack = TaskStack(humanoid, [*hands, *lower])
    alone = TaskStack(humanoid, hands)
    for _ in range(200):
        for task in (*hands, lower[0]):
            target = task.target
            target.translation = target.translation + rng.normal(size=3) * 0.02
            task.set_target(target)
        alone.reset(stack.v_previous)
        solution, reference = stack.solve(DT), alone.solve(DT)
        W = stack.levels[0].qp.W
        leak = np.abs(W @ (solution.dq - reference.dq)).max()
        assert leak <= 1e-9  # the issue asks for 1e-5
        humanoid.update(humanoid.integrate(solution.dq))


def test_a_level_is_optimal_among_what_the_upper_leave(humanoid):
    hand, posture = FrameTask("rarm_wrist2_joint"), PostureTask(1.0, level=1)
    stack = TaskStack(humanoid, [hand, posture], joint_limits=False)
    q = humanoid.q.copy()
    q[7:] += 0.1
    posture.set_target(q)
    solution = stack.solve(DT)
    W, mu = stack.levels[0].qp.W, float(stack.levels[1].qp.mu[0])
    _, s, Vt = np.linalg.svd(W)
    N = Vt[(s > 1e-9).sum() :].T
    weights, steps = stack.levels[1].qp.diagonal
    gradient = (weights + mu) * solution.dq - steps
    np.testing.assert_allclose(N.T @ gradient, 0.0, atol=1e-10)
    assert np.abs(solution.dq).max() > 1e-3


def test_more_levels_than_a_stack_holds_are_refused(arm):
    tasks = [PostureTask(1.0, level=k, name=f"posture {k}") for k in range(7)]
    assert TaskStack(arm, tasks[:6]).solve(DT).ok
    with pytest.raises(ConfigError, match="7 levels, but there may be at most 6"):
        TaskStack(arm, tasks)
