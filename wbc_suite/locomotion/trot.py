"""A trot with footholds by the capture point, for robots of four feet.

Sources: Raibert (1986), "Legged robots that balance"; Pratt et al. (2006), "Capture
point: a step toward humanoid push recovery", Humanoids.
"""

import numpy as np

from wbc_suite.compiling import compiled, inner
from wbc_suite.locomotion.gait import (
    GRAVITY,
    Gait,
    Measured,
    Mode,
    Plan,
    approach_command,
    heading_axes,
)
from wbc_suite.locomotion.swing import write_swing
from wbc_suite.typing import Vector

_STAND, _STEP = int(Mode.STAND), int(Mode.STEP)

RECOVERY_TIME = 2.0
"""s for which a robot steps that was pushed."""

SLIP_SPEED = 0.15
"""m/s; a standing foot that is faster has lost its hold."""

LOADING_TIME = 0.03
"""s in which a foot takes over its load, and leaves it."""

SETTLING_TIME = 0.3
"""s after the reset, and after the last step, in which feet may slip."""

REFERENCE_LEAD_MAX = 0.1
"""m; the reference is not farther from the centre of mass."""

STANDING_GAINS = (60.0, 20.0)
STEPPING_GAINS = (10.0, 8.0)
HEIGHT_GAINS = (150.0, 24.0)
"""1/s^2 and 1/s."""

COM_ACCELERATION_MAX = 12.0
"""m/s^2; acceleration of the centre of mass."""


@compiled
def plan_trot(
    gait: Gait, measured: Measured, command: Vector, dt: float, plan: Plan
) -> None:
    """Plan the feet and the centre of mass of a trot.

    Args:
        gait: Settings and state.
        measured: Where the robot is.
        command: Forward, left (m/s), turn (rad/s), height above the nominal one (m).
        dt: Time since the last call, s.
        plan: Output.
    """
    state, settings = gait.state[0], gait.settings[0]
    com, velocity = measured.com, measured.com_velocity
    moving = approach_command(state, command, settings.acceleration, dt)
    state.yaw += state.velocity[2] * dt
    R = heading_axes(state.yaw)
    wanted = np.empty(2)
    for i in range(2):
        wanted[i] = R[i, 0] * state.velocity[0] + R[i, 1] * state.velocity[1]
    _move_reference(state.reference, wanted, com, dt)
    plan.margin[0] = capture_point_margin(gait, measured, state.height)
    _switch_mode(gait, measured, moving, plan.margin[0])
    if state.mode == _STEP:
        state.phase = (state.phase + dt / settings.period) % 1.0
    _plan_feet(gait, measured, wanted, plan)
    stepping = state.mode == _STEP
    for i in range(2):
        kp = STEPPING_GAINS[0] if stepping else STANDING_GAINS[0]
        kd = STEPPING_GAINS[1] if stepping else STANDING_GAINS[1]
        a = kp * (state.reference[i] - com[i]) + kd * (wanted[i] - velocity[i])
        plan.com_acceleration[i] = min(
            max(a, -COM_ACCELERATION_MAX), COM_ACCELERATION_MAX
        )
        lever = state.height / GRAVITY
        plan.zmp[i] = com[i] - lever * plan.com_acceleration[i]
    error = state.ground + state.height - com[2]
    plan.com_acceleration[2] = HEIGHT_GAINS[0] * error - HEIGHT_GAINS[1] * velocity[2]


@inner
def _move_reference(reference: Vector, wanted: Vector, com: Vector, dt: float) -> None:
    """Move the reference of the centre of mass, on a leash."""
    x = reference[0] + wanted[0] * dt - com[0]
    y = reference[1] + wanted[1] * dt - com[1]
    share = min(1.0, REFERENCE_LEAD_MAX / max(np.sqrt(x * x + y * y), 1e-12))
    reference[0], reference[1] = com[0] + share * x, com[1] + share * y


@inner
def capture_point_margin(gait: Gait, measured: Measured, height: float) -> float:
    """Return how far the capture point is inside the box about all feet, m."""
    state = gait.state[0]
    R, time = heading_axes(state.yaw), np.sqrt(height / GRAVITY)
    margin = np.inf
    for i in range(2):
        low, high, x = np.inf, -np.inf, 0.0
        for j in range(2):
            x += R[j, i] * measured.com_velocity[j] * time
        for k in range(measured.foot.shape[0]):
            at = 0.0
            for j in range(2):
                at += R[j, i] * (measured.foot[k, j] - measured.com[j])
            low, high = min(low, at), max(high, at)
        margin = min(margin, high - x, x - low)
    return margin


@inner
def _switch_mode(gait: Gait, measured: Measured, moving: bool, margin: float) -> None:
    """Begin to step for a command or after a push; stand when both are over."""
    state, settings = gait.state[0], gait.settings[0]
    v = measured.com_velocity
    speed = np.sqrt(v[0] ** 2 + v[1] ** 2)
    if state.mode == _STAND:
        pushed = margin < settings.margin or speed > settings.speed
        settled = state.time > state.since + SETTLING_TIME
        for k in range(measured.slip.shape[0]):
            pushed = pushed or (settled and measured.slip[k] > SLIP_SPEED)
        if pushed and state.time > SETTLING_TIME and settings.recover > 0.0:
            state.until = state.time + RECOVERY_TIME
        if moving or state.time < state.until:
            state.mode, state.phase = _STEP, 0.0
        return
    at_rest = not moving and state.time > state.until
    for i in range(3):
        at_rest = at_rest and abs(state.velocity[i]) < 0.02
    if at_rest and state.phase % 0.5 < 0.02:
        state.mode, state.since = _STAND, state.time
        state.reference[0], state.reference[1] = measured.com[0], measured.com[1]


@inner
def _plan_feet(gait: Gait, measured: Measured, wanted: Vector, plan: Plan) -> None:
    """Write loads of standing feet, and the motion of those that swing."""
    state, settings = gait.state[0], gait.settings[0]
    stance = settings.duty * settings.period
    ground, standing = 0.0, 0
    for k in range(gait.offset.shape[0]):
        phase = (state.phase + gait.offset[k]) % 1.0
        if state.mode == _STAND or phase < settings.duty:
            left = stance - phase * settings.period
            load = min(phase * settings.period, left) / LOADING_TIME + 0.2
            plan.load[k] = 1.0 if state.mode == _STAND else min(1.0, load)
            gait.swings[k], standing = 0, standing + 1
            ground += measured.foot[k, 2]
            continue
        if gait.swings[k] == 0:
            gait.swings[k], state.steps = 1, state.steps + 1
            for i in range(3):
                gait.lift[k, i] = measured.foot[k, i]
        plan.load[k], plan.yaw[k] = 0.0, state.yaw
        s = (phase - settings.duty) / (1.0 - settings.duty)
        swing = settings.period - stance
        _place_foot(gait, measured, wanted, k, (1.0 - s) * swing)
        plan.footstep[0], plan.footstep[1] = gait.goal[k, 0], gait.goal[k, 1]
        apex = settings.apex
        write_swing(plan, k, gait.lift[k], gait.goal[k], state.ground, apex, s, swing)
    if standing >= 2:
        state.ground += 0.02 * (ground / standing - state.ground)


@inner
def _place_foot(
    gait: Gait, measured: Measured, wanted: Vector, k: int, left: float
) -> None:
    """Write where a foot lands: under its hip, by speed and capture point.

    Args:
        gait: Settings and state.
        measured: Where the robot is.
        wanted: Velocity as commanded, world axes, m/s, shape (2,).
        k: The foot.
        left: Time until it lands, s.
    """
    state, settings = gait.state[0], gait.settings[0]
    half = 0.5 * settings.duty * settings.period
    R = heading_axes(state.yaw + state.velocity[2] * (left + half))
    time = np.sqrt(state.height / GRAVITY)
    step, length = np.empty(2), 0.0
    for i in range(2):
        v = measured.com_velocity[i]
        step[i] = half * wanted[i] + time * (v - wanted[i])
        length += step[i] ** 2
    share = min(1.0, settings.reach / max(np.sqrt(length), 1e-12))
    for i in range(2):
        hip = measured.com[i] + left * measured.com_velocity[i]
        hip += R[i, 0] * gait.nominal[k, 0] + R[i, 1] * gait.nominal[k, 1]
        gait.goal[k, i] = hip + share * step[i]
