"""QP solvers behind one small interface."""

import warnings
from typing import Any, ClassVar, Protocol

import daqp
import numpy as np

from wbc_suite.errors import SolverError, UnknownNameError
from wbc_suite.qp.least_distance import LeastDistance
from wbc_suite.qp.problem import UNBOUNDED, Problem
from wbc_suite.typing import Vector

__all__ = ["DaqpSolver", "QpSolver", "QpsolversSolver", "make_solver"]

_TOLERANCE = 1e-10
_ITERATIONS = 1000  # of one solve, some 10 ms; a humanoid's takes up to 100


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
    """daqp on the bounds that matter, see `least_distance`; it remembers which did.

    The factor of H and the bounds that do not bind are a compiled kernel's work: on a
    humanoid that takes half the time that daqp takes with a dense H.

    A workspace is kept for the last size of problem, and one of daqp's for each number
    of rows that it was asked about.

    Primal tolerance 1e-10; the default of 1e-6 would let joints out of their limits by
    as much. Iterations are capped, not seconds: what a robot does must not depend on
    how busy its computer is.

    Source: Arnstrom, Bemporad, Axehill (2022), "A Dual Active-Set Solver for Embedded
    Quadratic Programming Using Recursive LDL^T Updates", IEEE TAC 67(8).
    """

    def __init__(self) -> None:
        self._size = 0, 0, 0
        self._space: LeastDistance | None = None  # until a problem tells its size
        self._models: dict[int, daqp.Model] = {}

    def fresh(self) -> "DaqpSolver":
        """Return another, without memory."""
        return DaqpSolver()

    def solve(self, problem: Problem) -> tuple[Vector, Vector] | None:
        """Solve; see `QpSolver`."""
        size = (problem.nv, len(problem.rows), problem.equalities)
        space = self._space
        if space is None or size != self._size:
            space = LeastDistance(*size)
            self._size, self._space = size, space
        constraints = problem.rows, problem.lower, problem.upper
        count = space.begin(problem.H, problem.c, *constraints)
        if count < 0:
            return None
        forces = np.zeros(0)
        while True:
            if count:
                forces = self._forces(space, count)
            if forces is None:
                space.forget()  # a failed active set is no warm start
                return None
            broken = space.complete(forces, *constraints)
            if broken == count:
                return space.x.copy(), space.multipliers.copy()
            count = broken

    def _forces(self, space: LeastDistance, count: int) -> Vector | None:
        """Return the multipliers of the small problem; None where daqp finds none."""
        M, high, low = space.M[:count, :count].copy(), space.high[:count], space.low
        sense = space.sense[:count].astype(np.intc)
        model = self._models.get(count)
        if model is None:
            model = self._models[count] = daqp.Model()
            model.settings = {"primal_tol": _TOLERANCE, "iter_limit": _ITERATIONS}
            flag, _ = model.setup(
                np.eye(count), np.zeros(count), M, high, low[:count], sense
            )
        else:
            flag = model.update(A=M, bupper=high, blower=low[:count], sense=sense)
        if flag >= 0:
            _, _, flag, info = model.solve()
            if flag > 0:
                return info["lam"]
        del self._models[count]
        return None


class QpsolversSolver:
    """Any solver that qpsolvers knows, for comparison and for users' own choice.

    proxqp runs at 1e-9: at its default it reports success with x off by 0.2 in flat
    directions when warm-started. It runs sparse: its dense form gives up on some
    problems that the sparse one solves to 1e-9.
    """

    _SPARSE = ("proxqp", "osqp", "clarabel")

    _OPTIONS: ClassVar[dict[str, dict[str, Any]]] = {
        "proxqp": {
            "eps_abs": 1e-9,
            "eps_rel": 0.0,
            "backend": "sparse",
            "max_iter": 100,
        },
        "osqp": {
            "eps_abs": 1e-8,
            "eps_rel": 0.0,
            "max_iter": 20000,
            "time_limit": 1.0,  # s
        },
        "piqp": {"eps_abs": 1e-9, "eps_rel": 0.0},
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

        used = problem.h < UNBOUNDED
        matrix = csc_matrix if self.name in self._SPARSE else np.array
        qp = qpsolvers.Problem(
            matrix(problem.H),
            problem.c,
            matrix(problem.G[used]) if used.any() else None,
            problem.h[used] if used.any() else None,
            matrix(problem.A) if problem.equalities else None,
            problem.b if problem.equalities else None,
            problem.lb,
            problem.ub,
        )
        try:
            with warnings.catch_warnings():
                # How a solver ended is in what it returns; a tick prints nothing.
                warnings.simplefilter("ignore")
                solution = qpsolvers.solve_problem(  # pyright: ignore[reportUnknownMemberType]
                    qp, self.name, **self._OPTIONS.get(self.name, {})
                )
        except (qpsolvers.exceptions.QPError, ValueError, ArithmeticError):
            return None
        if not solution.found or solution.x is None or solution.z_box is None:
            return None
        multipliers = np.zeros(len(problem.upper))
        nv, rows = problem.nv, len(problem.G)
        multipliers[:nv] = solution.z_box
        if used.any():
            multipliers[nv : nv + rows][used] = solution.z
        if problem.equalities:
            multipliers[nv + rows :] = solution.y
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
