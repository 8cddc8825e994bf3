"""Stacks of QP tasks for contact forces and accelerations.

`DynamicsStack` takes the tasks of a `TaskStack`. The unknowns are the forces y_f along
the edges of friction pyramids and the accelerations of the actuated joints,
y = (y_f, a_j). The equations of motion of a free root,

    M_b a + h_b = (J_c^T f)_b,

give the root's acceleration as X y + x, so that no equality is left, and torques are
affine rows of y. A task with error e and Jacobian J, d(e) = -J dq, asks for

    J a + J' v = kp e - kd J v + feed-forward.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from wbc_suite.arguments import check_array, check_number
from wbc_suite.compiling import as_argument
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.dynamics_space import (
    Contact,
    DynamicsSpace,
    Equations,
    MomentumTask,
    Rows,
)
from wbc_suite.qp.fallback import checked_solve, solve_relaxed
from wbc_suite.qp.lie import saturate
from wbc_suite.qp.limit import (
    BoxLimit,
    Limit,
    RowLimit,
    merge_bounds,
    unlimited_bounds,
)
from wbc_suite.qp.problem import UNBOUNDED, Problem
from wbc_suite.qp.solution import Fallback
from wbc_suite.qp.solver import make_solver
from wbc_suite.qp.task import JointTask, Task
from wbc_suite.typing import Matrix, Vector

FORCE_COST, MOTION_COST = 1e-3, 1e-3
"""Least costs of a force, [cost]/N, and of an acceleration, [cost]/(rad/s^2)."""

RELAXED = 1e4
"""Cost of what is missing from a row limit that cannot be kept, [cost]^2/(m/s^2)^2."""

_RANK = 1e-9


class DynamicsSolution(NamedTuple):
    """Accelerations, torques and contact forces of one tick.

    Attributes:
        a: Accelerations, shape (nv,).
        tau: Torques of the actuated joints, N m or N, shape (nv,) or (nv - 6,).
        forces: Force at each point of each contact, world axes, N, shape (k, 3).
        fallback: Which easier problem was solved.
        residual: By how much the worst bound or torque limit is violated.
        missing: What each task lacks of the acceleration that it asks for, (dim,).
    """

    a: Vector
    tau: Vector
    forces: dict[str, Matrix]
    fallback: Fallback
    residual: float
    missing: dict[str, Vector]

    @property
    def ok(self) -> bool:
        """Whether the problem was solved as stated."""
        return self.fallback is Fallback.NONE

    def __str__(self) -> str:
        """Return the fallback, the load of each contact, and what each task lacks."""
        lines = [f"DynamicsSolution: {self.fallback} (residual {self.residual:.1g})"]
        lines += [
            f"  {name}: {force[:, 2].sum():.1f} N"
            for name, force in self.forces.items()
        ]
        lines += [
            f"  {name} lacks {np.linalg.norm(missing):.3g} of its acceleration"
            for name, missing in self.missing.items()
        ]
        return "\n".join(lines)


class DynamicsStack:
    """A stack of QP tasks that is solved for contact forces and accelerations.

    A free-flyer root is not actuated; every other joint is, within the model's effort
    limits.

    Args:
        configuration: The robot; the stack moves it to q when it solves.
        tasks: Tasks; those of a lower level leave the levels above as they are.
        limits: Limits of positions, velocities and accelerations, and rows such as
            self-collision; rows give way where they cannot be kept.
        contacts: What rests on the ground.
        kp: Stiffness of all tasks, 1/s^2.
        kd: Damping, 1/s; critical when absent.
        gains: Other (kp, kd) of single tasks, by name.
        solver: Name of the QP solver.

    Attributes:
        feedforward: Accelerations to add, by the name of a task, shape (dim,).

    Raises:
        UnknownNameError: If a name is not one of the model or of a task.
        ConfigError: If a number is out of range.
    """

    def __init__(
        self,
        configuration: Configuration,
        tasks: Sequence[Task | MomentumTask],
        limits: Sequence[Limit] = (),
        *,
        contacts: Sequence[Contact] = (),
        kp: float = 100.0,
        kd: float | None = None,
        gains: Mapping[str, tuple[float, float]] | None = None,
        solver: str = "daqp",
    ) -> None:
        self.configuration, self.tasks = configuration, tuple(tasks)
        self.feedforward = dict[str, Vector]()
        kp = check_number("kp", kp, above=0.0)
        critical = 2.0 * float(np.sqrt(kp))
        damping = critical if kd is None else check_number("kd", kd, least=0.0)
        names = [task.name for task in self.tasks]
        for name in gains or ():
            if name not in names:
                raise UnknownNameError("task", name, names)
        self._gains = {name: (kp, damping) for name in names} | dict(gains or {})
        self._solver = make_solver(solver)
        self._space = DynamicsSpace(configuration, contacts)
        for task in self.tasks:
            if not isinstance(task, MomentumTask):
                task.bind(configuration)
        self._bounds = unlimited_bounds(configuration)
        self._row_limits = [limit for limit in limits if isinstance(limit, RowLimit)]
        for limit in limits:
            if isinstance(limit, BoxLimit):
                limit.apply(configuration, self._bounds)
            else:
                limit.bind(configuration)

    def solve(self, q: Vector, v: Vector, dt: float) -> DynamicsSolution:
        """Return accelerations and torques at a state.

        Args:
            q: Positions, shape (nq,).
            v: Velocities in Pinocchio's conventions, shape (nv,).
            dt: Time until the next solution, s; limits are kept for that long.

        Raises:
            ConfigError: If an argument is not finite, or has a wrong shape.
        """
        q = check_array("q", q, (self.configuration.model.nq,))
        v = check_array("v", v, (self.configuration.model.nv,))
        dt = check_number("dt", dt, above=0.0)
        if not (np.isfinite(q).all() and np.isfinite(v).all()):
            raise ConfigError("q and v must be finite.")
        tasks = [self._task_rows(task, q, v) for task in self.tasks]
        self.configuration.update(q)
        edges, contacts = self._space.contact_rows(q, v)
        equations = self._space.equations(q, v, edges)
        problem = self._stated(equations, v, dt)
        y, fallback = self._solve_levels(problem, [*contacts, *tasks], equations)
        a = equations.X @ y + equations.x
        forces = edges.T @ y[: len(edges)]
        return DynamicsSolution(
            a=a,
            tau=(equations.M @ a + equations.h - forces)[self._space.root :],
            forces=self._space.forces(y),
            fallback=fallback,
            residual=problem.violation(y),
            missing={row.name: row.wanted - row.J @ a for row in tasks},
        )

    def _task_rows(self, task: Task | MomentumTask, q: Vector, v: Vector) -> Rows:
        """Return the rows of a task; the configuration is left near q."""
        if isinstance(task, MomentumTask):
            return self._space.momentum_rows(task, q, v)
        self.configuration.update(q)
        error, (kp, kd) = task.error(self.configuration), self._gains[task.name]
        if isinstance(task, JointTask):
            jacobian, cost = np.eye(len(error)), np.sqrt(task.squared_costs)
            drift = np.zeros(len(error))
            np.clip(
                error, -task.max_speed * kd / kp, task.max_speed * kd / kp, out=error
            )
        else:
            jacobian, cost = task.jacobian(self.configuration), task.cost
            drift = self._space.drift(task, q, v)
            for part, speed in zip(
                np.split(error, [task.angular_start]), task.max_speeds, strict=True
            ):
                saturate(part, speed * kd / kp)
        wanted = kp * error - kd * (jacobian @ v) - drift
        wanted = wanted + self.feedforward.get(task.name, 0.0)
        if not np.isfinite(wanted).all():  # without a target nothing is asked for
            wanted, cost = np.zeros(len(error)), np.zeros(len(error))
        return Rows(task.name, task.level, jacobian, wanted, cost)

    def _stated(self, equations: Equations, v: Vector, dt: float) -> Problem:
        """Return the problem with its bounds, and without the cost of tasks."""
        M, h, edges, X, x = equations
        k, r = len(edges), self._space.root
        joints = len(h) - r
        soft = sum(limit.dim for limit in self._row_limits)
        problem = Problem(k + joints, joints + soft)
        least = np.repeat([FORCE_COST**2, MOTION_COST**2], [k, joints])
        problem.H[:] = np.diag(least)
        pressed = [
            np.full(4 * len(c.points), c.stage * c.max_force / (4 * len(c.points)))
            for c in self._space.contacts
        ]
        low, high = self._window(v, dt)
        problem.lb[:] = np.concatenate([np.zeros(k), low[r:]])
        problem.ub[:] = np.concatenate([*pressed, high[r:]])
        effort = self.configuration.model.upperEffortLimit[r:]
        effort = np.where(effort > 0.0, effort, UNBOUNDED)
        torque, still = M[r:] @ X, M[r:] @ x + h[r:]
        torque[:, :k] -= edges[:, r:].T
        problem.G[:joints] = torque
        rows = slice(problem.nv, problem.nv + joints)
        problem.lower[rows], problem.upper[rows] = -effort - still, effort - still
        first = joints
        for limit in self._row_limits:
            last = first + limit.dim
            G, most = np.zeros((limit.dim, len(v))), np.zeros(limit.dim)
            limit.rows(self.configuration, dt, G, most)
            rate = (most / dt - G @ v) / dt
            problem.G[first:last] = G @ X
            problem.wanted[first:last] = np.minimum(rate - G @ x, UNBOUNDED)
            first = last
        problem.weight = RELAXED
        return problem

    def _window(self, v: Vector, dt: float) -> tuple[Vector, Vector]:
        """Return the bounds of accelerations, shape (nv,) each; never empty."""
        lower, upper = np.empty((2, len(v)))
        kinds = np.zeros(2 * len(v), dtype=np.int64)
        bounds = as_argument(self._bounds)
        merge_bounds(bounds, self.configuration.q, v, dt, lower, upper, kinds)
        return (lower / dt - v) / dt, (upper / dt - v) / dt

    def _solve_levels(
        self, problem: Problem, rows: list[Rows], equations: Equations
    ) -> tuple[Vector, Fallback]:
        """Return y; levels are solved one after another, each within those above."""
        kept, y, worst = np.zeros((0, problem.nv)), np.zeros(problem.nv), Fallback.NONE
        levels = sorted({row.level for row in rows} | {0})
        for level in levels:
            own = [row for row in rows if row.level == level]
            J = np.concatenate(
                [kept[:0], *(r.cost[:, None] * (r.J @ equations.X) for r in own)]
            )
            missing = [r.cost * (r.wanted - r.J @ equations.x) for r in own]
            stated = Problem(problem.nv, len(problem.G), len(kept))
            stated.H[:] = problem.H + J.T @ J
            stated.c[:] = -J.T @ np.concatenate([np.zeros(0), *missing])
            bounds = len(problem.lower)
            stated.lower[:bounds], stated.upper[:bounds] = problem.lower, problem.upper
            stated.G[:], stated.A[:] = problem.G, kept
            stated.wanted[:], stated.weight = problem.wanted, problem.weight
            stated.set_equalities(kept @ y)
            solver = self._solver if level == 0 else self._solver.fresh()
            fallback = Fallback.NONE
            result = checked_solve(solver, stated)
            if result is None and level > 0:
                worst = max(worst, Fallback.LEVEL)
                continue
            if result is None:
                *result, fallback = solve_relaxed(stated)
            y, worst = result[0], max(worst, fallback)
            if level < levels[-1]:
                kept = _row_space(np.concatenate([kept, J]))
        return y, worst


def _row_space(W: Matrix) -> Matrix:
    """Return an orthonormal basis of the rows of W."""
    _, lengths, V = np.linalg.svd(W, full_matrices=False)
    return V[lengths > _RANK * max(1.0, lengths[0] if len(lengths) else 0.0)]
