"""One tick of a level in one compiled call.

`write_rows` writes the rows of all compiled tasks; `tick` writes bounds and rows of the
first level, and answers with the optimum where the active set of the last tick leads
there. What happens inside is told in `bounds`, `rows` and `active_set`.
"""

from enum import IntEnum

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.kinematics.array_table import indices, matrix, vector
from wbc_suite.kinematics.forward import RobotField, place_joints, weigh_joints
from wbc_suite.qp.active_set import solve_warm
from wbc_suite.qp.bounds import merge_bounds
from wbc_suite.qp.problem import worst_violation
from wbc_suite.qp.rows import (
    com_rows,
    damping_of_rows,
    frame_rows,
    normal_equations,
    posture_terms,
)
from wbc_suite.typing import Indices, Vector

__all__ = [
    "LOST",
    "SOLVED",
    "STATED",
    "TOLERANCE",
    "UNUSABLE",
    "BoxField",
    "RowField",
    "tick",
    "write_rows",
]

TOLERANCE = 1e-7
"""A step that breaks a row or bound by more is not taken, m or rad."""

LOST, UNUSABLE, STATED, SOLVED = range(4)
"""What comes of a tick: q is not finite; rows are not; H and c are written for a
solver; the answer is written."""


class RowField(IntEnum):
    """Arrays of a level's rows; the arguments of the kernels in `rows`."""

    FRAME_JOINTS = 0
    FRAME_OFFSETS = 1
    FRAME_TASKS = 2
    FRAME_ROW = 3
    FRAME_SUPPORT_START = 4
    FRAME_SUPPORT = 5
    FRAME_ERRORS = 6
    COM_TASKS = 7
    COM_ROW = 8
    COM_ERRORS = 9
    Q_INDEX = 10
    POSTURE_COSTS = 11
    POSTURE_TARGETS = 12
    POSTURE_GAINS = 13
    ROW_START = 14
    SUPPORT_START = 15
    SUPPORT = 16
    W = 17
    E = 18
    GIVEN = 19
    DIAGONAL = 20


class BoxField(IntEnum):
    """Arrays of the first level's bounds, constraints and answer.

    The answer holds the step, the velocity, the multipliers of bounds and rows, and the
    kinds of the bounds.
    """

    Q_LOWER = 0
    Q_UPPER = 1
    V_MAX = 2
    A_MAX = 3
    V_PREVIOUS = 4
    KINDS = 5
    H = 6
    C = 7
    ROWS = 8
    EQUALITIES = 9
    LOWER = 10
    UPPER = 11
    SIDE = 12
    ANSWER = 13
    WANTED = 14


@compiled
def _copy(values: Vector | Indices, out: Vector) -> None:
    """Copy values; a slice assignment would take 2 s to compile, for its error text."""
    for i in range(values.shape[0]):
        out[i] = values[i]


@compiled
def write_rows(
    robot: Indices, rows: Indices, dt: float, damping: float, curvature: float
) -> tuple[float, bool]:
    """Write all compiled tasks of a level.

    The diagonal begins with what is given: the terms of tasks outside the kernels.

    Args:
        robot: Table of `RobotField`.
        rows: Table of `RowField`.
        dt: Step, s.
        damping: See `damping_of_rows`.
        curvature: See `damping_of_rows`.

    Returns:
        mu of `damping_of_rows`, and whether all targets were finite.
    """
    com_tasks = indices(rows, RowField.COM_TASKS)
    place_joints(robot)
    if com_tasks.shape[0]:
        weigh_joints(robot)
    W, e = matrix(rows, RowField.W), vector(rows, RowField.E)
    diagonal = matrix(rows, RowField.DIAGONAL)
    _copy(vector(rows, RowField.GIVEN), vector(rows, RowField.DIAGONAL))
    finite = frame_rows(
        matrix(robot, RobotField.PLACEMENT),
        matrix(robot, RobotField.JACOBIAN),
        indices(rows, RowField.FRAME_JOINTS),
        matrix(rows, RowField.FRAME_OFFSETS),
        indices(rows, RowField.FRAME_TASKS),
        indices(rows, RowField.FRAME_ROW),
        indices(rows, RowField.FRAME_SUPPORT_START),
        indices(rows, RowField.FRAME_SUPPORT),
        dt,
        W,
        e,
        matrix(rows, RowField.FRAME_ERRORS),
    )
    finite &= com_rows(
        vector(robot, RobotField.COM),
        matrix(robot, RobotField.COM_JACOBIAN),
        com_tasks,
        indices(rows, RowField.COM_ROW),
        dt,
        W,
        e,
        vector(rows, RowField.COM_ERRORS),
    )
    finite &= posture_terms(
        vector(robot, RobotField.Q),
        indices(rows, RowField.Q_INDEX),
        matrix(rows, RowField.POSTURE_COSTS),
        indices(rows, RowField.POSTURE_TARGETS),
        matrix(rows, RowField.POSTURE_GAINS),
        dt,
        diagonal,
    )
    mu = damping_of_rows(
        W,
        e,
        indices(rows, RowField.ROW_START),
        indices(rows, RowField.SUPPORT_START),
        indices(rows, RowField.SUPPORT),
        damping,
        curvature,
    )
    return mu, finite


@compiled
def tick(
    robot: Indices,
    rows: Indices,
    box: Indices,
    dt: float,
    position_gain: float,
    damping: float,
    curvature: float,
    warm: bool,
) -> tuple[int, float, bool, float]:
    """Write bounds and rows of the first level, and its optimum or normal equations.

    With the optimum, the previous velocity becomes the present one.

    Args:
        robot: Table of `RobotField`.
        rows: Table of `RowField`.
        box: Table of `BoxField`.
        dt: Step, s.
        position_gain: See `merge_bounds`.
        damping: See `damping_of_rows`.
        curvature: See `damping_of_rows`.
        warm: Whether the last active set may answer.

    Returns:
        What came of it; mu of `damping_of_rows`; whether all targets were finite; by
        how much the answer breaks its worst constraint.
    """
    kinds, answer = indices(box, BoxField.KINDS), vector(box, BoxField.ANSWER)
    lower, upper = vector(box, BoxField.LOWER), vector(box, BoxField.UPPER)
    v_max = vector(box, BoxField.V_MAX)
    v_previous, nv = vector(box, BoxField.V_PREVIOUS), v_max.shape[0]
    lb, ub = lower[:nv], upper[:nv]
    if not merge_bounds(
        vector(robot, RobotField.Q),
        indices(rows, RowField.Q_INDEX),
        vector(box, BoxField.Q_LOWER),
        vector(box, BoxField.Q_UPPER),
        position_gain,
        v_max,
        v_previous,
        vector(box, BoxField.A_MAX),
        dt,
        lb,
        ub,
        kinds[:nv],
        kinds[nv:],
    ):
        return LOST, np.nan, True, np.inf
    mu, finite = write_rows(robot, rows, dt, damping, curvature)
    if not np.isfinite(mu):
        return UNUSABLE, mu, finite, np.inf
    if warm:
        A = matrix(box, BoxField.EQUALITIES)
        first = lower.shape[0] - A.shape[0]
        for i in range(answer.shape[0]):
            answer[i] = 0.0
        x = answer[:nv]
        answered = solve_warm(
            matrix(rows, RowField.W),
            vector(rows, RowField.E),
            A,
            lower[first:],
            matrix(rows, RowField.DIAGONAL),
            mu,
            lb,
            ub,
            indices(box, BoxField.SIDE),
            x,
            answer[2 * nv : 3 * nv],
            answer[2 * nv + first : 2 * nv + lower.shape[0]],
        )
        if answered:
            worst = worst_violation(x, matrix(box, BoxField.ROWS), lower, upper)
            if worst <= TOLERANCE:
                for i in range(nv):
                    v_previous[i] = x[i] / dt
                _copy(v_previous, answer[nv : 2 * nv])
                _copy(kinds, answer[2 * nv + lower.shape[0] :])
                return SOLVED, mu, finite, worst
    normal_equations(
        matrix(rows, RowField.W),
        vector(rows, RowField.E),
        indices(rows, RowField.ROW_START),
        indices(rows, RowField.SUPPORT_START),
        indices(rows, RowField.SUPPORT),
        matrix(rows, RowField.DIAGONAL),
        mu,
        matrix(box, BoxField.H),
        vector(box, BoxField.C),
    )
    return STATED, mu, finite, np.inf
