"""Formulas of operational space control, for controllers of users."""

from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from wbc_suite.compat.robosuite.utils import transform_utils as T
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Matrix, Vector


def jit_decorator(func: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of arrays and numbers when it is called first."""
    return numba.njit(func)


def nullspace_torques(
    mass_matrix: Matrix,
    nullspace_matrix: Matrix,
    initial_joint: Vector,
    joint_pos: Vector,
    joint_vel: Vector,
    joint_kp: float = 10.0,
) -> Vector:
    """Return torques that pull joints to a posture without moving the hand, N m.

    N^T M (kp (q0 - q) - 2 sqrt(kp) v), critically damped.
    """
    pull = joint_kp * (initial_joint - joint_pos)
    return nullspace_matrix.T @ (mass_matrix @ (pull - 2 * joint_kp**0.5 * joint_vel))


def opspace_matrices(
    mass_matrix: Matrix, J_full: Matrix, J_pos: Matrix, J_ori: Matrix
) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Return inertias at the hand, (J M^-1 J^T)^+, of all, position and orientation.

    The fourth is the projection to the null space, I - M^-1 J^T Lambda J.
    """
    responses = [np.linalg.solve(mass_matrix, J.T) for J in (J_full, J_pos, J_ori)]
    full, pos, ori = (
        np.linalg.pinv(J @ response)
        for J, response in zip((J_full, J_pos, J_ori), responses, strict=True)
    )
    projection = np.eye(J_full.shape[1]) - responses[0] @ full @ J_full
    return full, pos, ori, projection


def orientation_error(desired: Matrix, current: Matrix) -> Vector:
    """Return half the sum of the cross products of the axes: sin(angle) axis."""
    return 0.5 * np.cross(current[:3, :3], desired[:3, :3], axis=0).sum(axis=1)


def set_goal_position(
    delta: Vector | None,
    current_position: Vector,
    position_limit: Matrix | None = None,
    set_pos: Vector | None = None,
) -> Vector:
    """Return the goal `set_pos`, or a move from a position, within limits (2, n), m.

    Raises:
        ConfigError: If the limits have another shape.
    """
    goal = set_pos
    if goal is None:
        goal = current_position + np.asarray(delta)
    if position_limit is None:
        return goal
    _check(position_limit, len(current_position))
    return np.clip(goal, *position_limit)


def set_goal_orientation(
    delta: Vector | None,
    current_orientation: Matrix,
    orientation_limit: Matrix | None = None,
    set_ori: Matrix | None = None,
) -> Matrix:
    """Return the goal `set_ori`, or a turn by an axis times an angle, rad.

    Its Euler angles are clipped to limits, shape (2, 3): to the end that is nearer.

    Raises:
        ConfigError: If the limits have another shape.
    """
    goal = set_ori
    if goal is None:
        goal = T.quat2mat(T.axisangle2quat(delta)) @ current_orientation
    if orientation_limit is None or not np.any(orientation_limit):
        return goal
    _check(orientation_limit, 3)
    angles, (low, high) = T.mat2euler(goal), np.asarray(orientation_limit)
    width, beyond = (high - low) % (2 * np.pi), (angles - low) % (2 * np.pi)
    outside = beyond > width
    if not outside.any():
        return goal
    nearer = np.where(beyond - width < 2 * np.pi - beyond, high, low)
    return T.euler2mat(np.where(outside, nearer, angles))


def _check(limits: Any, count: int) -> None:
    if np.shape(limits) != (2, count):
        raise ConfigError(
            f"Limits have the shape {np.shape(limits)}, not (2, {count})."
        )
