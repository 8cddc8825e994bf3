"""Strict levels: what a lower level wants never moves what an upper one decided."""

import numpy as np

from wbc_suite.qp import ComTask, FrameTask, PostureTask, TaskStack
from wbc_suite.qp.row_space import row_space

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
        W = stack._levels[0].W
        leak = np.abs(W @ (solution.dq - reference.dq)).max()
        assert leak <= 1e-9  # the issue asks for 1e-5
        humanoid.update(humanoid.integrate(solution.dq))


def test_a_level_is_optimal_among_what_the_upper_leave(humanoid):
    hand, posture = FrameTask("rarm_wrist2_joint"), PostureTask(1.0, level=1)
    stack = TaskStack(humanoid, [hand, posture], limits=[])
    q = humanoid.q.copy()
    q[7:] += 0.1
    posture.set_target(q)
    solution = stack.solve(DT)
    W, mu = stack._levels[0].W, stack._levels[1].mu
    _, s, Vt = np.linalg.svd(W)
    N = Vt[(s > 1e-9).sum() :].T
    weights, steps = stack._levels[1].diagonal
    gradient = (weights + mu) * solution.dq - steps
    np.testing.assert_allclose(N.T @ gradient, 0.0, atol=1e-10)
    assert np.abs(solution.dq).max() > 1e-3


def test_row_space_is_that_of_the_singular_value_decomposition(rng):
    for rows, rank in ((5, 5), (12, 7), (30, 20)):
        W = rng.normal(size=(rows, rank)) @ rng.normal(size=(rank, 20))
        V, lengths = np.zeros((20, 20)), np.zeros(20)
        found = row_space(W.copy(), 1e-9, V, lengths)
        assert found == rank
        basis = V[:rank]
        np.testing.assert_allclose(basis @ basis.T, np.eye(rank), atol=1e-13)
        np.testing.assert_allclose(W @ basis.T @ basis, W, atol=1e-11)
        assert (np.diff(lengths[:rank]) <= 0).all()
