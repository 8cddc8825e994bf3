"""A walk of two feet by the divergent component of motion (DCM).

    xi = c + c' / omega,     xi' = omega (xi - z),     c'' = omega^2 (c - z)

The centre of pressure z steers the DCM xi within the sole of the foot that stands; what
it cannot reach is left to the next step, whose place *and* time are searched.

Sources: Englsberger et al. (2015), "Three-dimensional bipedal walking control based on
divergent component of motion", IEEE T-RO 31(2); Khadiv et al. (2017), "Walking control
based on step timing adaptation", arXiv 1704.01271.
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
from wbc_suite.locomotion.soles import keep_in_soles
from wbc_suite.locomotion.swing import write_swing
from wbc_suite.typing import Vector

_STAND, _STEP = int(Mode.STAND), int(Mode.STEP)

RECOVERY_TIME = 1.6
"""s for which a robot steps that was pushed."""

SETTLING_TIME = 0.5
"""s after the reset in which the robot does not step by itself."""

SHIFT_TIME = 0.6
"""s in which the weight shifts to the first foot."""

START_DISTANCE = 0.015
"""m; distance of the DCM from where a walk begins; it grows while the robot waits."""

STEP_OVERSHOOT = 0.01
"""m; how far the DCM leaves the soles before the robot steps by itself."""

PUSH_DISTANCE = 0.06
"""m; distance of the DCM from its reference at which a walk counts as pushed."""

NO_STEP_GAIN = 20.0
"""1/s; feedback on the DCM of a robot that may not step."""

COMMIT_TIME = 0.06
"""s before the landing at which place and time of a step are fixed."""

FIXED_SHARE = 0.85
"""Part of the swing after which the place is fixed."""

LANDED_HEIGHT, LANDING_SPEED, LANDING_DELAY_MAX = 0.012, 0.1, 0.1
"""m, m/s, s; a step waits for a foot that is higher and sinks faster, for so long."""

CANDIDATES = 9
"""Step times that are tried."""

FASTEST = 3.0
"""m/s; mean speed of a swinging foot that costs nothing."""

HEIGHT_GAINS = (100.0, 20.0)
"""1/s^2 and 1/s."""


@compiled
def plan_walk(
    gait: Gait, measured: Measured, command: Vector, dt: float, plan: Plan
) -> None:
    """Plan the feet and the centre of mass of a walk.

    Args:
        gait: Settings and state; foot 0 is the left one.
        measured: Where the robot is.
        command: Forward, left (m/s), turn (rad/s), height above the nominal one (m).
        dt: Time since the last call, s.
        plan: Output.
    """
    state, settings = gait.state[0], gait.settings[0]
    com, velocity = measured.com, measured.com_velocity
    moving = approach_command(state, command, settings.acceleration, dt)
    carried = state.height - settings.lower * min(1.0, state.time)
    omega = np.sqrt(GRAVITY / carried)
    dcm = np.empty(2)
    for i in range(2):
        dcm[i] = com[i] + velocity[i] / omega
    plan.load[0] = plan.load[1] = 1.0
    zmp = np.empty(2)
    if state.mode == _STAND:
        _stand(gait, measured, dcm, omega, moving, dt, plan, zmp)
    if state.mode == _STEP:
        _step(gait, measured, dcm, omega, moving, dt, plan, zmp)
    for i in range(2):
        plan.zmp[i] = zmp[i]
        plan.com_acceleration[i] = omega**2 * (com[i] - zmp[i])
    state.ground = measured.foot[state.stance, 2]
    error = state.ground + carried - com[2]
    plan.com_acceleration[2] = HEIGHT_GAINS[0] * error - HEIGHT_GAINS[1] * velocity[2]


@inner
def _stand(
    gait: Gait,
    measured: Measured,
    dcm: Vector,
    omega: float,
    moving: bool,
    dt: float,
    plan: Plan,
    zmp: Vector,
) -> None:
    """Keep the DCM between the feet; shift it, and step, for a command or a push."""
    state, settings = gait.state[0], gait.settings[0]
    wanted, inside, R = np.empty(2), np.empty(2), heading_axes(state.yaw)
    for i in range(2):
        wanted[i] = 0.5 * (measured.foot[0, i] + measured.foot[1, i])
        wanted[i] += settings.ahead * R[i, 0]
    middle = wanted.copy()
    if moving:
        _, own, _ = _periodic_step(gait, omega, state.stance)
        state.shift = min(1.0, state.shift + dt / SHIFT_TIME)
        gap = 0.0
        for i in range(2):
            start = measured.foot[state.stance, i] + own[i]
            wanted[i] += state.shift * (start - wanted[i])
            gap += (dcm[i] - wanted[i]) ** 2
        if state.shift >= 1.0:
            state.waiting += dt
            if np.sqrt(gap) < START_DISTANCE + 0.05 * state.waiting:
                _begin_step(gait, state.stance, 0.0)
    else:
        state.shift = max(0.0, state.shift - dt / SHIFT_TIME)
    plan.margin[0] = keep_in_soles(gait, measured, dcm, -1, inside)
    pushed = plan.margin[0] < -STEP_OVERSHOOT and settings.recover > 0.0
    if pushed and state.time > SETTLING_TIME:
        side = 0.0
        for i in range(2):
            side += R[i, 1] * (dcm[i] - middle[i])
        state.until = state.time + RECOVERY_TIME
        _begin_step(gait, 1 if side > 0.0 else 0, settings.double_support)
    gain = settings.gain if settings.recover > 0.0 else NO_STEP_GAIN
    for i in range(2):
        zmp[i] = dcm[i] + gain / omega * (dcm[i] - wanted[i])
    if settings.recover > 0.0:
        keep_in_soles(gait, measured, zmp.copy(), -1, zmp)


@inner
def _begin_step(gait: Gait, stance: int, since: float) -> None:
    state = gait.state[0]
    state.mode, state.stance, state.since = _STEP, stance, since
    state.duration, state.steps = gait.settings[0].step, state.steps + 1
    state.shift = state.waiting = 0.0
    gait.swings[0] = gait.swings[1] = 0


@inner
def _step(
    gait: Gait,
    measured: Measured,
    dcm: Vector,
    omega: float,
    moving: bool,
    dt: float,
    plan: Plan,
    zmp: Vector,
) -> None:
    """Track the DCM of a periodic walk, and adapt the step to what is left."""
    state, settings = gait.state[0], gait.settings[0]
    state.since += dt
    state.yaw += state.velocity[2] * dt
    if state.since >= state.duration and _has_landed(gait, measured):
        at_rest = not moving and state.steps > 2 and state.time > state.until
        for i in range(3):
            at_rest = at_rest and abs(state.velocity[i]) < 0.02
        hurry = settings.double_support if state.time < state.until else 0.0
        _begin_step(gait, 1 - state.stance, hurry)
        if at_rest:
            state.mode, state.steps = _STAND, 0
            keep_in_soles(gait, measured, dcm, -1, zmp)
            return
    stance, swing = state.stance, 1 - state.stance
    both = state.since < settings.double_support
    _, own, landing = _periodic_step(gait, omega, stance)
    wanted, growth, far = np.empty(2), np.exp(omega * state.since), 0.0
    for i in range(2):
        foot = measured.foot[stance, i]
        error = dcm[i] - foot - own[i] * growth
        far += error**2
        wanted[i] = foot + (1.0 + settings.gain / omega) * error
    if np.sqrt(far) > PUSH_DISTANCE:
        state.until = max(state.until, state.time + 0.5)
    keep_in_soles(gait, measured, wanted, -1 if both else stance, zmp)
    plan.margin[0] = keep_in_soles(gait, measured, dcm, -1 if both else stance, wanted)
    if state.since < state.duration - COMMIT_TIME:
        _choose_duration(gait, measured, dcm, zmp, landing, omega, both)
    if both:
        left = 1.0 - state.since / settings.double_support
        plan.load[swing] = max(left, 0.03)
        plan.load[stance] = min(1.0, state.since / 0.03 + 0.3)
        return
    goal = np.empty(2)
    _landing_place(gait, measured, dcm, zmp, landing, omega, state.duration, goal)
    plan.footstep[0], plan.footstep[1] = goal[0], goal[1]
    _swing(gait, measured, goal, dt, plan)


@inner
def _has_landed(gait: Gait, measured: Measured) -> bool:
    """Return whether the weight may go to the foot that swings, or has to."""
    state = gait.state[0]
    swing, stance = measured.foot[1 - state.stance], measured.foot[state.stance]
    late = state.since - state.duration > LANDING_DELAY_MAX
    rests = measured.rise[1 - state.stance] > -LANDING_SPEED
    return bool(late or rests or swing[2] - stance[2] < LANDED_HEIGHT)


@inner
def _swing(gait: Gait, measured: Measured, goal: Vector, dt: float, plan: Plan) -> None:
    """Write the motion of the swinging foot."""
    state, settings = gait.state[0], gait.settings[0]
    stance, swing = state.stance, 1 - state.stance
    if gait.swings[swing] == 0:
        gait.swings[swing], state.progress = 1, 0.0
        for i in range(3):
            gait.lift[swing, i] = measured.foot[swing, i]
        gait.lift_yaw[swing] = measured.foot_yaw[swing]
    left = max(state.duration - state.since, 0.0) + dt
    state.progress += min(1.0, dt / left) * (1.0 - state.progress)
    s = min(1.0, state.progress)
    duration = min(max(left / max(1.0 - s + 1e-3, 1e-2), 0.15), 1.0)
    if s < FIXED_SHARE:
        gait.goal[swing, 0], gait.goal[swing, 1] = goal[0], goal[1]
    plan.load[swing] = 0.0
    plan.yaw[swing] = state.yaw + state.velocity[2] * left
    ground = measured.foot[stance, 2]
    write_swing(
        plan,
        swing,
        gait.lift[swing],
        gait.goal[swing],
        ground,
        settings.apex,
        s,
        duration,
    )


@inner
def _periodic_step(
    gait: Gait, omega: float, stance: int
) -> tuple[Vector, Vector, Vector]:
    """Return the next step, and the DCM about the feet at the beginning of steps.

    In a periodic walk `b_k e^(omega T) = d_k + b_(k+1)`, with steps d of alternating
    sides and the DCM b about the foot that stands.

    Returns:
        The step d, b about this foot now, and b about the next foot when it stands;
        world axes, m, shape (2,) each.
    """
    state, settings = gait.state[0], gait.settings[0]
    T = settings.step
    growth = np.exp(omega * T)
    side = -1.0 if stance == 0 else 1.0
    forward, left = state.velocity[0] * T, state.velocity[1] * T
    this, other = side * state.width + left, -side * state.width + left
    along = forward / (growth - 1.0)
    after = (other * growth + this) / (growth**2 - 1.0)
    now = (this * growth + other) / (growth**2 - 1.0)
    R = heading_axes(state.yaw)
    step, own, landing = np.empty(2), np.empty(2), np.empty(2)
    for i in range(2):
        step[i] = R[i, 0] * forward + R[i, 1] * this
        own[i] = R[i, 0] * along + R[i, 1] * now
        landing[i] = R[i, 0] * along + R[i, 1] * after
    return step, own, landing


@inner
def _landing_place(
    gait: Gait,
    measured: Measured,
    dcm: Vector,
    zmp: Vector,
    landing: Vector,
    omega: float,
    duration: float,
    goal: Vector,
) -> float:
    """Write where a step of a duration has to land; return what legs cannot reach, m.

    The DCM then is where the periodic walk has it about the next foot.
    """
    state, settings = gait.state[0], gait.settings[0]
    R, foot = heading_axes(state.yaw), measured.foot[state.stance]
    growth = np.exp(omega * max(duration - state.since, 0.0))
    side = -1.0 if state.stance == 0 else 1.0
    x, y = 0.0, 0.0
    for i in range(2):
        place = zmp[i] + (dcm[i] - zmp[i]) * growth - landing[i] - foot[i]
        x += R[i, 0] * place
        y += R[i, 1] * place
    near_x = min(max(x, -settings.backward), settings.forward)
    near_y = side * min(max(side * y, settings.narrowest), settings.widest)
    for i in range(2):
        goal[i] = foot[i] + R[i, 0] * near_x + R[i, 1] * near_y
    return np.sqrt((x - near_x) ** 2 + (y - near_y) ** 2)


@compiled
def _choose_duration(
    gait: Gait,
    measured: Measured,
    dcm: Vector,
    zmp: Vector,
    landing: Vector,
    omega: float,
    both: bool,
) -> None:
    """Choose the step time: little out of reach, no fast swing, little change."""
    state, settings = gait.state[0], gait.settings[0]
    first = max(state.since + COMMIT_TIME, settings.shortest)
    goal, best, swing = np.empty(2), np.inf, measured.foot[1 - state.stance]
    for k in range(CANDIDATES):
        duration = first + (settings.step - first) * k / (CANDIDATES - 1)
        missed = _landing_place(
            gait, measured, dcm, zmp, landing, omega, duration, goal
        )
        cost = 10.0 * missed + 0.3 * abs(duration - settings.step)
        if not both:
            way = np.sqrt((goal[0] - swing[0]) ** 2 + (goal[1] - swing[1]) ** 2)
            reach = FASTEST * max(duration - state.since, 0.01)
            cost += 4.0 * max(0.0, way - reach)
        if cost < best - 1e-9:
            best, state.duration = cost, duration
