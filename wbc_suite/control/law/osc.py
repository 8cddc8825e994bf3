"""The law in operational space: its class, and its kernel."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import compiled, inner
from wbc_suite.control.ground.physics import OscWork, Physics
from wbc_suite.control.ground.records import Drives, LawKind, LawRecord
from wbc_suite.control.ground.rigid_body import (
    matrix_product,
    moves_body,
    point_jacobian_column,
    point_velocity_and_drift,
    rotation,
    write_inertia,
)
from wbc_suite.control.law.law import Law
from wbc_suite.control.memory import Parts
from wbc_suite.control.poses import pose_vector
from wbc_suite.control.state import RobotState
from wbc_suite.linear_algebra import (
    cholesky,
    inverse_trace,
    lq_factor,
    lq_solve,
    solve_lower,
    solve_upper,
)
from wbc_suite.qp.lie import exp3, log3, saturate
from wbc_suite.robot.arms import FEW_JOINTS, has_few_joints
from wbc_suite.typing import Matrix, Vector

SINGULAR = 1e-4
"""1/kg or 1/(kg m^2); directions in which the hand is less mobile are damped."""

LEAST_DAMPING = 1e-9
"""1/s; the velocity that stiffness asks for is kp / kd."""


class OscLaw(Law):
    """A site follows its goal; joints hold a posture in its null space.

    Among all joint accelerations that move the site as wanted, the nearest to those
    that the posture asks for, measured by inertia:

        minimise    (a - a0)^T M (a - a0)
        subject to  J a = x'' - J' v,     x'' = kd (u - v_s),  u = kp / kd e + v*

    Its KKT conditions give, with the inertia L = (J M^-1 J^T)^-1 at the site,

        a = a0 + M^-1 J^T L (x'' - J' v - J a0),    tau = M a + h.

    e is the error of pose (rotation vector of `R* R^T`), v_s the site's velocity and v*
    that of the reference, all in the axes of the reference body, in which kp and kd may
    differ by axis: `x'' = kp e + kd e'`. The velocity u is saturated at `speed`, for
    linear and angular motion each. A goal in a moving reference body moves with it. A
    wrench f displaces the site by `(L kp)^-1 f`.

    Where joints saturate, see `osc_saturation`. The site's name is that in the robot.

    Source: Khatib (1987), "A unified approach for motion and force control of robot
    manipulators: the operational space formulation", IEEE J. Robotics and Automation.
    """

    def __init__(self, state: RobotState, joints: Sequence[str], site: str) -> None:
        super().__init__(LawKind.OSC, state, joints)
        self.record["site"] = state.model.site(state.prefix + site).id
        self.record["speed"] = np.inf
        few = has_few_joints(state.robot, site)
        self.record["turn_weight"] = FEW_JOINTS if few else 1.0

    @property
    def gains(self) -> Parts:
        """Stiffness and damping of the site; views of its record."""
        return self.record["kp"], self.record["kd"]

    def set_goal(
        self,
        goal: pin.SE3 | Vector,
        *,
        start: pin.SE3 | None = None,
        duration: float = 0.0,
    ) -> None:
        """Set the goal, a pose or its `pose_vector`, in the axes of the reference body.

        The reference moves there from `start`, by default the goal itself, at constant
        velocities in `duration` seconds.
        """
        vector = pose_vector(goal) if isinstance(goal, pin.SE3) else goal
        record = self.record
        record["start"], record["shift"], record["turn"] = vector, 0.0, 0.0
        if start is not None:
            record["start"] = pose_vector(start)
            record["shift"] = vector[9:] - start.translation
            record["turn"] = pin.log3(start.rotation.T @ vector[:9].reshape(3, 3))
        record["since"], record["duration"] = 0.0, duration

    def frames(self, state: RobotState) -> tuple[Matrix, Vector, Matrix, Vector]:
        """Return views of rotation and position of the reference, then of the site."""
        body, site = int(self.record["reference"][0]), int(self.record["site"][0])
        data = state.data
        R_wb, R_ws = data.xmat[body].reshape(3, 3), data.site_xmat[site].reshape(3, 3)
        return R_wb, data.xpos[body], R_ws, data.site_xpos[site]

    def target_pose(self) -> tuple[pin.SE3, Vector]:
        """Return pose and twist of the reference, in the reference body's axes."""
        R, p, twist = np.empty((3, 3)), np.empty(3), np.empty(6)
        interpolate_pose(self.record[0], np.eye(3), np.zeros(3), R, p, twist)
        return pin.SE3(R, p), twist

    def site_pose(self, state: RobotState) -> pin.SE3:
        """Return the site's pose in the axes of the reference body."""
        R_wb, p_wb, R_ws, p_ws = self.frames(state)
        return pin.SE3(R_wb, p_wb).actInv(pin.SE3(R_ws, p_ws))


@compiled
def osc_law(physics: Physics, law: LawRecord, drives: Drives) -> None:
    """Write the joint accelerations of `OscLaw`.

    With `M = C C^T` and `z = C^T (a - a0)` the law is the shortest z with

        Y z = x'' - J' v - J a0,    Y = J C^-T,    Y Y^T = J M^-1 J^T,

    found by an LQ factorisation of Y: as exact as Y itself, where the mobility `Y Y^T`
    of a stretched arm has lost half of the digits. An arm of few joints cannot do both
    halves: its angular rows have a small weight.
    """
    n, work = law.last - law.first, physics.osc
    J, C, wanted, posture, z = work.J, work.C, work.wanted, work.posture, work.z
    write_hand_task(physics, law, drives)
    for i in range(3, 6):
        wanted[i] *= law.turn_weight
        work.pull[i] *= law.turn_weight
        for j in range(n):
            J[i, j] *= law.turn_weight
    for i in range(6):
        for j in range(n):
            wanted[i] -= J[i, j] * posture[j]
        solve_lower(C, J[i], n)
    _write_damped_factors(J, n, work.L, work.Q, work.column)
    solve_lower(work.L, wanted, 6)
    lq_solve(work.Q, n + 6, wanted, z)
    solve_upper(C, z, n)
    for j in range(n):
        physics.acceleration[work.dofs[j]] = posture[j] + z[j]


@inner
def write_hand_task(physics: Physics, law: LawRecord, drives: Drives) -> None:
    """Write what a law of a hand begins with, in `physics.osc`.

    These are the law's `dofs`, the accelerations `posture` that hold its posture,
    `wanted = x'' - J' v` and its part `pull`, the Jacobian J and the factor C of the
    joints' inertia.
    """
    n, work = law.last - law.first, physics.osc
    for j in range(n):
        drive = drives[law.first + j]
        work.dofs[j] = drive.dof
        error = drive.position - physics.qpos[drive.qpos]
        work.posture[j] = drive.kp * error - drive.kd * physics.qvel[drive.dof]
    _write_task_acceleration(physics, law)
    _write_site_jacobian(physics, law, n)
    write_inertia(physics, work.dofs, n, work.C)
    cholesky(work.C, n, 0.0)


@inner
def _write_damped_factors(
    Y: Matrix, n: int, L: Matrix, Q: Matrix, column: Vector
) -> None:
    """Write L, (6, 6), and Q, (6, n + 6), of `[Y, s I] = L Q`; L's diagonal inverted.

    The least mobility `m = 1 / trace((Y Y^T)^-1)` is at most its least eigenvalue.
    Where it is below `SINGULAR` the law is damped by `s^2 = SINGULAR - m`.
    """
    missing = 0.0
    for _ in range(2):
        for i in range(6):
            for j in range(n):
                Q[i, j] = Y[i, j]
            for j in range(6):
                Q[i, n + j] = np.sqrt(missing) if i == j else 0.0
        lq_factor(Q, n + 6, L)
        missing = SINGULAR - inverse_trace(L, column)
        if missing <= 0.0:
            break


@inner
def _write_site_jacobian(physics: Physics, law: LawRecord, n: int) -> None:
    """Write the site's Jacobian; subtract what other joints add from `wanted`.

    Other joints are those of laws before this one. Joints that carry the reference body
    as well move the goal with the site.
    """
    work = physics.osc
    body = int(physics.site_bodyid[law.site])
    p = physics.site_xpos[law.site]
    for i in range(6):
        for j in range(n):
            work.J[i, j] = 0.0
    dof = int(physics.body_last_dof[body])
    while dof >= 0:
        point_jacobian_column(physics, dof, body, p, work.column)
        own = -1
        for j in range(n):
            if work.dofs[j] == dof:
                own = j
        if own >= 0:
            for i in range(6):
                work.J[i, own] = work.column[i]
        elif not moves_body(physics, dof, law.reference):
            for i in range(6):
                work.wanted[i] -= work.column[i] * physics.acceleration[dof]
        dof = int(physics.dof_parentid[dof])


@inner
def _write_task_acceleration(physics: Physics, law: LawRecord) -> None:
    """Write `wanted = x'' - J' v`, and its part `pull = kd u` towards the goal."""
    work = physics.osc
    p_ws, R_ws = physics.site_xpos[law.site], rotation(physics.site_xmat, law.site)
    p_wb, R_wb = physics.xpos[law.reference], rotation(physics.xmat, law.reference)
    R_goal, R_error = np.empty((3, 3)), np.empty((3, 3))
    p_goal, error, twist = np.empty(3), np.empty(6), np.empty(6)
    interpolate_pose(law, R_wb, p_wb, R_goal, p_goal, twist)
    matrix_product(R_goal, R_ws.T, R_error)
    log3(R_error, error[3:])
    for i in range(3):
        error[i] = p_goal[i] - p_ws[i]
    body, velocity, drift = int(physics.site_bodyid[law.site]), np.empty(6), np.empty(6)
    point_velocity_and_drift(physics, law.reference, p_goal, velocity, work.wanted)
    point_velocity_and_drift(physics, body, p_ws, work.column, drift)
    for i in range(6):
        velocity[i] -= work.column[i]
        work.wanted[i] -= drift[i]
    _add_feedback(law, R_wb, error, twist, velocity, work)


@inner
def interpolate_pose(
    law: LawRecord,
    R_wb: Matrix,
    p_wb: Vector,
    R_goal: Matrix,
    p_goal: Vector,
    twist: Vector,
) -> None:
    """Write the goal of an `OscLaw` at this time, and its twist, in the world.

    In the axes of the reference body, whose pose is (R_wb, p_wb), the goal moves from
    `start` by `shift` and `turn` in `duration`, at constant velocities. The twist,
    linear then angular, is relative to that body.
    """
    phase, rate = 1.0, 0.0
    if law.duration > 0.0:
        phase = min(law.since / law.duration, 1.0)
        rate = 1.0 / law.duration if law.since <= law.duration else 0.0
    R_start, R_turned = np.empty((3, 3)), np.empty((3, 3))
    matrix_product(R_wb, law.start[:9].reshape((3, 3)), R_start)
    exp3(phase * law.turn[0], phase * law.turn[1], phase * law.turn[2], R_turned)
    matrix_product(R_start, R_turned, R_goal)
    for i in range(3):
        p_goal[i], twist[i], twist[3 + i] = p_wb[i], 0.0, 0.0
        for k in range(3):
            p_goal[i] += R_wb[i, k] * (law.start[9 + k] + phase * law.shift[k])
            twist[i] += rate * R_wb[i, k] * law.shift[k]
            twist[3 + i] += rate * R_start[i, k] * law.turn[k]


@inner
def _add_feedback(
    law: LawRecord,
    R_wb: Matrix,
    error: Vector,
    twist: Vector,
    velocity: Vector,
    work: OscWork,
) -> None:
    """Write `pull = kd u`; add `kd (u + v)` to wanted. Gains are in the axes R_wb.

    The twist is that of the reference in the reference body; v the velocity of the goal
    by that body, less that of the site.
    """
    u, pull, wanted = np.empty(3), work.pull, work.wanted
    for half in range(2):
        f = 3 * half
        for k in range(3):
            rate = law.kp[f + k] / max(law.kd[f + k], LEAST_DAMPING)
            u[k] = pull[f + k] = 0.0
            for i in range(3):
                u[k] += R_wb[i, k] * (rate * error[f + i] + twist[f + i])
        saturate(u, law.speed[half])
        for k in range(3):
            kd, v = max(law.kd[f + k], LEAST_DAMPING), 0.0
            for i in range(3):
                v += R_wb[i, k] * velocity[f + i]
            for i in range(3):
                pull[f + i] += R_wb[i, k] * kd * u[k]
                wanted[f + i] += R_wb[i, k] * kd * (u[k] + v)
