"""The optimum of random stacks against an exact solver, and all solvers' agreement."""

import numpy as np
import pinocchio as pin
import pytest
import quadprog

from wbc_suite.compiling import as_argument
from wbc_suite.errors import SolverError, UnknownNameError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    ComTask,
    DampingTask,
    FrameEquality,
    FrameTask,
    LookAtTask,
    PostureTask,
    Problem,
    RelativeFrameTask,
    TaskStack,
)
from wbc_suite.qp.active_set import make_qp_arrays, solve_warm
from wbc_suite.qp.fallback import box_least_squares, checked_solve
from wbc_suite.qp.solver import make_solver

FRAMES = ("rarm_wrist2_joint", "larm_wrist2_joint", "lleg_wrist2_joint", "head2_joint")
FOOT = "rleg_wrist2_joint"


def exact(problem: Problem) -> np.ndarray:
    """Solve with quadprog (Goldfarb and Idnani 1983), bounds written as rows."""
    n = problem.nv
    rows = np.vstack([problem.A, -problem.G, np.eye(n), -np.eye(n)])
    least = np.concatenate([problem.b, -problem.h, problem.lb, -problem.ub])
    kept = np.isfinite(least) & (np.abs(least) < 1e20)
    return quadprog.solve_qp(
        problem.H, -problem.c, rows[kept].T, least[kept], problem.equalities
    )[0]


def random_pose(rng, robot, frame):
    step = pin.exp6(rng.normal(size=6) * rng.choice([0.01, 0.3]))
    return robot.frame_pose(frame) * step


def random_stack(robot: Configuration, rng: np.random.Generator) -> TaskStack:
    """Return a stack of random tasks, costs and targets, at a random configuration."""
    q = pin.neutral(robot.model)
    dq = rng.normal(size=robot.nv) * 0.5
    dq[6:] = np.clip(dq[6:], -1.99, 1.99)
    robot.update(pin.integrate(robot.model, q, dq))

    def cost():
        return float(rng.choice([0.1, 1.0, 10.0]))

    tasks = [
        FrameTask(
            frame,
            target=random_pose(rng, robot, frame),
            position_cost=cost(),
            orientation_cost=cost(),
            gain=rng.uniform(0.1, 1.0),
        )
        for frame in rng.permutation(FRAMES)[: rng.integers(1, 5)]
    ]
    extra = [
        ComTask(cost(), target=rng.normal(size=3)),
        DampingTask(0.1 * cost()),
        LookAtTask("head1_joint", target=rng.normal(size=3), cost=cost()),
        RelativeFrameTask(FRAMES[0], FRAMES[1], position_cost=cost()),
    ]
    tasks += [task for task in extra if rng.random() < 0.5]
    tasks.append(PostureTask(0.01 * cost(), target=q))
    feet = [FrameEquality(FOOT)] if rng.random() < 0.5 else []
    stack = TaskStack(robot, tasks, equalities=feet, escape=False)
    stack.reset(np.clip(rng.normal(size=robot.nv) * 0.2, -1.0, 1.0))
    return stack


def worst_deviation(robot, count, seed) -> tuple[float, int]:
    rng = np.random.default_rng(seed)
    worst, compared = 0.0, 0
    for _ in range(count):
        stack = random_stack(robot, rng)
        solution = stack.solve(float(rng.choice([1e-3, 5e-3, 2e-2])))
        if not solution.ok:  # held feet against a random velocity: see robustness
            continue
        compared += 1
        worst = max(worst, np.abs(solution.dq - exact(stack.problem())).max())
    return worst, compared


@pytest.mark.slow
def test_optimum_is_exact_on_random_stacks(humanoid):
    worst, compared = worst_deviation(humanoid, 200, seed=1)
    assert worst <= 1e-8
    assert compared >= 100


@pytest.mark.sweep
@pytest.mark.slow
def test_optimum_is_exact_on_ten_thousand_random_stacks(humanoid):
    worst, compared = worst_deviation(humanoid, 14_000, seed=2)
    assert worst <= 1e-8
    assert compared >= 10_000


@pytest.mark.parametrize(
    ("name", "tolerance"),
    # Interior-point and first-order solvers stop at their own accuracy.
    [("quadprog", 1e-8), ("proxqp", 1e-6), ("piqp", 1e-4), ("clarabel", 1e-4)],
)
def test_solvers_by_name_agree(humanoid, name, tolerance):
    if name not in __import__("qpsolvers").available_solvers:
        pytest.skip(f"{name} is not installed")
    rng, given_up = np.random.default_rng(5), 0
    for _ in range(20):
        stack = random_stack(humanoid, rng)
        if not stack.solve(5e-3).ok:
            continue
        result = checked_solve(make_solver(name), stack.problem())
        if result is None:
            given_up += 1
            continue
        x, multipliers = result
        problem = stack.problem()
        np.testing.assert_allclose(x, exact(problem), atol=tolerance)
        pull = multipliers[: problem.nv] + problem.rows.T @ multipliers[problem.nv :]
        gradient = problem.H @ x + problem.c + pull
        np.testing.assert_allclose(gradient, 0.0, atol=100 * tolerance)
    allowed = {"proxqp": 2, "clarabel": 1}.get(name, 0)
    assert given_up <= allowed  # daqp solves these in a stack


def random_qp(rng, inequalities):
    """Return a random QP with bounds, equality rows, and some soft rows."""
    n, m = int(rng.integers(6, 40)), int(rng.integers(1, 20))
    k = int(rng.integers(0, 1 + (2 * n) // 3))  # levels above decide so much
    if inequalities:
        k = int(rng.integers(0, 1 + n // 4))
    p = int(rng.integers(1, 12)) if inequalities else 0
    diagonal, mu = np.abs(rng.normal(size=(2, n))), np.array([10 ** rng.uniform(-3, 0)])
    W, e = rng.normal(size=(m, n)), rng.normal(size=m)
    qp = make_qp_arrays(W, e, diagonal, mu, inequalities=p, equalities=k)
    qp.lower[:n], qp.upper[:n] = -rng.random(n), rng.random(n)
    qp.rows[:] = rng.normal(size=qp.rows.shape)
    inside = rng.uniform(qp.lower[:n], qp.upper[:n])
    values = qp.rows @ inside
    qp.upper[n:], qp.lower[n + p :] = values, values[p:]
    qp.upper[n : n + p] += 0.1 * rng.random(p)
    soft = rng.random(p) < 0.3
    qp.wanted[soft] = qp.upper[n : n + p][soft] - 0.2 * rng.random(int(soft.sum()))
    qp.weight[0] = 10 ** rng.uniform(0, 3)
    problem = Problem(n, p, k)
    problem.H[:] = W.T @ W + np.diag(diagonal[0] + mu)
    problem.c[:] = -W.T @ e - diagonal[1]
    problem.rows[:], problem.lower[:], problem.upper[:] = qp.rows, qp.lower, qp.upper
    problem.wanted[:], problem.weight = qp.wanted, float(qp.weight[0])
    return qp, problem


@pytest.mark.slow
@pytest.mark.parametrize("inequalities", [False, True])
def test_warm_active_set_answers_exactly_or_not_at_all(rng, inequalities):
    answers = 0
    for _ in range(300):
        qp, problem = random_qp(rng, inequalities)
        n, p = problem.nv, len(problem.G)
        argument = as_argument(qp)
        # The second call starts from the set that the first has found.
        for _ in range(2):
            if not solve_warm(argument) or problem.violation(qp.x) > 1e-7:
                continue
            answers += 1
            stated = problem.with_slack(problem.soft())
            np.testing.assert_allclose(qp.x, exact(stated)[:n], atol=1e-8)
            bounds, forces = qp.multipliers[:n], qp.multipliers[n:]
            gradient = problem.H @ qp.x + problem.c + bounds + problem.rows.T @ forces
            np.testing.assert_allclose(gradient, 0.0, atol=1e-7)
            assert (bounds * qp.side[:n] >= 0).all()
            assert (forces[:p] >= 0.0).all()
            assert (forces[:p][qp.side[n:] == 0] == 0.0).all()
    assert answers > 540


def random_problem(rng, n: int, inequalities: int, equalities: int) -> Problem:
    problem = Problem(n, inequalities, equalities)
    W = rng.normal(size=(n, n))
    problem.H[:], problem.c[:] = W.T @ W + 0.01 * np.eye(n), rng.normal(size=n)
    problem.lb[:], problem.ub[:] = -rng.random(n), rng.random(n)
    problem.rows[:] = rng.normal(size=problem.rows.shape)
    inside = rng.uniform(problem.lb, problem.ub)
    problem.h[:] = problem.G @ inside + 0.2 * rng.random(inequalities)
    problem.set_equalities(problem.A @ inside)
    return problem


def test_daqp_is_exact_whatever_bound_the_time_before(rng):
    for _ in range(30):
        n, solver = int(rng.integers(4, 20)), make_solver("daqp")
        for _ in range(5):  # of one size, and with nothing else in common
            problem = random_problem(rng, n, 6, 2)
            problem.G[1], problem.h[1] = problem.G[0], problem.h[0]  # both bind
            problem.G[2], problem.h[2] = 0.0, 0.1
            x, multipliers = solver.solve(problem) or pytest.fail("not solved")
            np.testing.assert_allclose(x, exact(problem), atol=1e-9)
            pull = multipliers[:n] + problem.rows.T @ multipliers[n:]
            np.testing.assert_allclose(problem.H @ x + problem.c, -pull, atol=1e-9)
            kept = np.concatenate([x, problem.rows @ x])
            at_upper = np.isclose(kept, problem.upper, atol=1e-9)
            at_lower = np.isclose(kept, problem.lower, atol=1e-9)
            assert (at_upper | (multipliers <= 0.0)).all()
            assert (at_lower | (multipliers >= 0.0)).all()


def test_daqp_tells_what_has_no_solution_and_goes_on(rng):
    solver, problem = make_solver("daqp"), random_problem(rng, 8, 2, 1)
    assert solver.solve(problem) is not None
    impossible = problem.copy()
    impossible.G[0], impossible.h[0] = 1.0, -1.0 + impossible.lb.sum()
    assert solver.solve(impossible) is None
    for value in (-1.0, np.nan):
        bent = problem.copy()
        bent.H[3, 3] = value
        assert solver.solve(bent) is None
    x, _ = solver.solve(problem) or pytest.fail("not solved")
    np.testing.assert_allclose(x, exact(problem), atol=1e-9)


def test_box_least_squares_converges_to_the_exact_optimum(rng):
    for _ in range(20):
        W = rng.normal(size=(12, 8))
        problem = Problem(8)
        problem.H[:], problem.c[:] = W.T @ W + 0.1 * np.eye(8), rng.normal(size=8)
        problem.lb[:], problem.ub[:] = -0.05, 0.1
        x = box_least_squares(problem.H, problem.c, problem.lb, problem.ub, 500)
        np.testing.assert_allclose(x, exact(problem), atol=1e-9)


def test_unknown_and_missing_solvers_are_told_apart(arm, monkeypatch):
    with pytest.raises(UnknownNameError, match="Did you mean 'daqp'"):
        TaskStack(arm, [], solver="dapq")
    monkeypatch.setattr("qpsolvers.available_solvers", ["daqp"])
    with pytest.raises(SolverError, match=r"wbc-suite\[solvers\]"):
        TaskStack(arm, [], solver="quadprog")
