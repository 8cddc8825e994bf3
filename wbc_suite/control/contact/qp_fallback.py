"""Solve the QP of a tick whose active set is not found."""

import numpy as np

from wbc_suite.qp.active_set import QpArrays
from wbc_suite.qp.fallback import checked_solve, solve_relaxed
from wbc_suite.qp.problem import Problem
from wbc_suite.qp.solution import Fallback
from wbc_suite.qp.solver import make_solver

SOFT = 1e4
"""Cost of what is missing from a limit that cannot be kept, 1/N^2 m^2."""


class QpFallback:
    """Solves by daqp, and else tries the easier problems of the stack.

    Args:
        qp: The arrays, for their sizes.
    """

    def __init__(self, qp: QpArrays) -> None:
        self._problem = Problem(len(qp.x), int(qp.counts[0]))
        self._solver = make_solver("daqp")

    def solve(self, qp: QpArrays) -> Fallback:
        """Write the optimum, or the nearest to it, to `qp.x`; return what it took."""
        problem = self._problem
        problem.H[:] = qp.W.T @ qp.W + np.diag(qp.diagonal[0] + qp.mu[0])
        problem.c[:] = -(qp.W.T @ qp.e) - qp.diagonal[1]
        problem.rows[:] = qp.rows
        problem.lower[:], problem.upper[:] = qp.lower, qp.upper
        result, fallback = checked_solve(self._solver, problem), Fallback.NONE
        if result is None:
            problem.weight = SOFT
            *result, fallback = solve_relaxed(problem)
        qp.x[:] = result[0]
        return fallback
