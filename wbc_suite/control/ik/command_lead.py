"""How far commands of whole-body inverse kinematics may lead their joints."""

from wbc_suite.compiling import compiled, inner
from wbc_suite.control.ground.records import Drives
from wbc_suite.control.law.spline_reference import SplineArrays, spline_end
from wbc_suite.qp.joint_window import braking_step
from wbc_suite.typing import CompiledRecords, Vector

MAX_LEAD = 0.25
"""rad or m; a command waits for a joint that lags behind by more, so that a joint does
not jump when it comes free. It waits sooner where the motor saturates. Where a contact
drives the joint away, the command follows it at this distance: the QP would otherwise
keep a robot off the scene that is elsewhere."""
EXCESS = 1.2
"""Speed or lag of a joint, over its limit or `MAX_LEAD`, at which commands brake."""


@compiled
def limit_steps(
    bounds: CompiledRecords,
    spline: SplineArrays,
    v: Vector,
    drives: Drives,
    qpos: Vector,
    qvel: Vector,
) -> None:
    """Write the greatest steps of commands that wait for their joints."""
    excess = _limit_lead(bounds, spline, v, drives, qpos, qvel)
    if excess > EXCESS:
        _brake(bounds, spline, v, min(excess / EXCESS - 1.0, 1.0))


@inner
def _limit_lead(
    bounds: CompiledRecords,
    spline: SplineArrays,
    v: Vector,
    drives: Drives,
    qpos: Vector,
    qvel: Vector,
) -> float:
    """Write the greatest steps with which commands do not lead their joints by more.

    The lead is e + (kd / kp) e', as feedback measures it. It grows by the velocity that
    the joint lacks: a step that is shorter than the last, of velocity v, by so much
    keeps it. A step may be longer by what can be braked within the lead that is left.
    It is negative, and leads back, where the lead is greater than `MAX_LEAD`.

    Returns the greatest speed or lag of a joint, relative to its limit or `MAX_LEAD`.
    """
    dt, excess = spline.period, 0.0
    for j in range(spline.q_index.shape[0]):
        drive, i = drives[j], spline.v_index[j]
        position, velocity = spline_end(spline, j)
        most, growth = drive.windup_max, velocity - qvel[drive.dof]
        lag, v_max = float(position - qpos[drive.qpos]), float(bounds[i].v_max)
        excess = max(excess, abs(float(qvel[drive.dof])) / v_max, abs(lag) / MAX_LEAD)
        lead = lag + drive.kd / drive.kp * growth
        kept, a_max = dt * (v[i] - growth), float(bounds[i].a_max)
        for side, sign in enumerate((-1.0, 1.0)):
            left = max(most - sign * lead, 0.0)
            longer = braking_step(float(left), 1.0, a_max, dt)
            slower = min(sign * v[i] * dt - a_max * dt**2, 0.0)
            least = slower if sign * lead > MAX_LEAD else 0.0
            bounds[i].step_max[side] = max(sign * kept + longer, least)
    return excess


@inner
def _brake(
    bounds: CompiledRecords, spline: SplineArrays, v: Vector, share: float
) -> None:
    """Brake all commands by a share of their greatest accelerations.

    A contact drives a joint: an arm presses its wrist down, or a base drives on with
    an arm that is jammed. Commands that have to lead back do so.
    """
    dt = spline.period
    for i in spline.v_index:
        step_max, window = bounds[i].step_max, share * bounds[i].a_max * dt**2
        for side, sign in enumerate((-1.0, 1.0)):
            slower = sign * v[i] * dt - window
            longest = max(slower, -step_max[1 - side], 0.0)
            step_max[side] = min(step_max[side], longest)
