"""QP solvers behind one small interface."""

import warnings
from typing import Any, ClassVar, Protocol

import daqp
import numpy as np

from wbc_suite.errors import SolverError, UnknownNameError
from wbc_suite.qp.problem import UNBOUNDED, Problem
from wbc_suite.typing import Vector

_TOLERANCE = 1e-10
_ITERATIONS = 1000  # of one solve, some 10 ms; a humanoid's takes up to 100
_EQUALITY = 5  # how daqp marks an equality row
_EXACT = {"eps_abs": 1e-9, "eps_rel": 0.0}


class QpSolver(Protocol):
    """Solves one `Problem` after another."""

    def solve(self, problem: Problem) -> tuple[Vector, Vector] | None:
        """Return x, shape (nv,), and the multipliers of x, G, A in this order.

        Multipliers are positive at upper bounds and negative at lower ones:
        `H x + c + lam_x + [G; A]^T lam_rows = 0`. None means not solved.
        """
        ...

    def fresh(self) -> "QpSolver":
        """Return a solver of the same kind without memory of earlier problems."""
        ...


class DaqpSolver:
    """daqp, with one workspace for the last size of problem; it is warm-started.

    Primal tolerance 1e-10; the default of 1e-6 would let joints out of their limits by
    as much. Iterations are capped, not seconds: what a robot does must not depend on
    how busy its computer is.

    Source: Arnstrom, Bemporad, Axehill (2022), "A Dual Active-Set Solver for Embedded
    Quadratic Programming Using Recursive LDL^T Updates", IEEE TAC 67(8).
    """

    def __init__(self) -> None:
        self._size = 0, 0
        self._model: daqp.Model | None = None  # until a problem fixes its size

    def fresh(self) -> "DaqpSolver":
        """Return another, without memory."""
        return DaqpSolver()

    def solve(self, problem: Problem) -> tuple[Vector, Vector] | None:
        """Solve; see `QpSolver`."""
        if not (np.isfinite(problem.H).all() and np.isfinite(problem.c).all()):
            return None
        sense = np.zeros(len(problem.upper), dtype=np.intc)
        sense[len(sense) - problem.equalities :] = _EQUALITY
        data = problem.H, problem.c, problem.rows, problem.upper, problem.lower, sense
        size = problem.nv, len(problem.rows)
        model, self._model = self._model, None  # one that fails is no warm start
        if model is None or size != self._size:
            model = daqp.Model()
            model.settings = {"primal_tol": _TOLERANCE, "iter_limit": _ITERATIONS}
            flag, _ = model.setup(*data)
        else:
            A = problem.rows if len(problem.rows) else None  # it rejects an empty one
            flag = model.update(*data[:2], A, *data[3:])
        if flag < 0:
            return None
        x, _, flag, info = model.solve()
        if flag <= 0:
            return None
        self._size, self._model = size, model
        return np.array(x), np.array(info["lam"])


class QpsolversSolver:
    """Any solver of qpsolvers, for comparison and for users' own choice.

    proxqp runs at 1e-9: at its default it reports success with x off by 0.2 in flat
    directions when warm-started. Its dense form takes half the time of the sparse one.
    Iterations are capped, as daqp's are; daqp solves what is left. clarabel's iterative
    refinement would change nothing; qpsolvers takes 0.3 ms to state its bounds as rows.
    """

    _OPTIONS: ClassVar[dict[str, dict[str, Any]]] = {
        "proxqp": {**_EXACT, "backend": "dense", "max_iter": 100},
        "osqp": {**_EXACT, "eps_abs": 1e-8, "max_iter": 100},
        "clarabel": {"max_iter": 12, "iterative_refinement_enable": False},
        "piqp": {**_EXACT, "max_iter": 50},
    }

    def __init__(self, name: str) -> None:
        self.name = name

    def fresh(self) -> "QpsolversSolver":
        """Return itself: it keeps no memory."""
        return self

    def solve(self, problem: Problem) -> tuple[Vector, Vector] | None:
        """Solve; see `QpSolver`."""
        import qpsolvers
        from scipy.sparse import csc_matrix

        nv, used = problem.nv, problem.h < UNBOUNDED
        rows, h, lb, ub = problem.G[used], problem.h[used], problem.lb, problem.ub
        if self.name == "clarabel":
            rows = np.vstack([rows, np.eye(nv), -np.eye(nv)])
            h, lb, ub = np.hstack([h, ub, -lb]), None, None
        matrix = csc_matrix if self.name in ("osqp", "clarabel") else np.array
        qp = qpsolvers.Problem(matrix(problem.H), problem.c, lb=lb, ub=ub)
        if len(h):
            qp.G, qp.h = matrix(rows), h
        if problem.equalities:
            qp.A, qp.b = matrix(problem.A), problem.b
        try:
            with warnings.catch_warnings():
                # How a solver ended is in what it returns; a tick prints nothing.
                warnings.simplefilter("ignore")
                solution = qpsolvers.solve_problem(  # pyright: ignore[reportUnknownMemberType]
                    qp, self.name, **self._OPTIONS.get(self.name, {})
                )
        except Exception:  # noqa: BLE001 - each solver raises errors of its own
            return None
        if not solution.found or solution.x is None or solution.z_box is None:
            return None
        z, z_box = np.array(solution.z), solution.z_box
        if self.name == "clarabel":
            z, above, below = np.split(z, [-2 * nv, -nv])
            z_box = above - below
        multipliers = np.zeros(len(problem.upper))
        multipliers[:nv] = z_box
        multipliers[nv : nv + len(used)][used] = z
        if problem.equalities:
            multipliers[nv + len(used) :] = solution.y
        return np.array(solution.x), multipliers


def make_solver(name: str) -> QpSolver:
    """Return the solver of a name: "daqp", or any that qpsolvers finds installed.

    Raises:
        SolverError: The solver is known but not installed.
        UnknownNameError: No solver has this name.
    """
    if name == "daqp":
        return DaqpSolver()
    import qpsolvers

    if name in qpsolvers.available_solvers:
        return QpsolversSolver(name)
    known = ("daqp", "proxqp", "osqp", "quadprog", "piqp", "clarabel")
    if name in known:
        raise SolverError(
            f"QP solver '{name}' is not installed. "
            "Install it with: pip install 'wbc-suite[solvers]'"
        )
    raise UnknownNameError("QP solver", name, {*known, *qpsolvers.available_solvers})
