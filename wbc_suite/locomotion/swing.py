"""Trajectories of swinging feet."""

from wbc_suite.compiling import compiled
from wbc_suite.locomotion.gait import Plan
from wbc_suite.typing import Vector

TOUCHDOWN_DEPTH = 0.004
"""m; feet swing to so far under the ground, so that they touch it in time."""

HORIZONTAL_SHARE = 0.95
"""Part of the swing after which a foot moves on its goal's vertical only."""


@compiled
def minimum_jerk(s: float) -> tuple[float, float, float]:
    """Return the minimum-jerk blend from 0 to 1, and its two derivatives by s."""
    s = min(max(s, 0.0), 1.0)
    value = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
    rate = 30.0 * s * s * (1.0 - s) ** 2
    return value, rate, 60.0 * s * (1.0 - 3.0 * s + 2.0 * s * s)


@compiled
def write_swing(
    plan: Plan,
    foot: int,
    lift: Vector,
    goal: Vector,
    ground: float,
    apex: float,
    s: float,
    duration: float,
) -> None:
    """Write position, velocity and acceleration of a swinging foot.

    Args:
        plan: Output.
        foot: Which foot.
        lift: Where it was lifted, m, shape (3,).
        goal: Where it lands, m, shape (2,).
        ground: Height of the ground there, m.
        apex: Height over the ground half way, m.
        s: Part of the swing, 0 to 1.
        duration: Of the whole swing, s.
    """
    p, v, a = plan.position[foot], plan.velocity[foot], plan.acceleration[foot]
    T = HORIZONTAL_SHARE * duration
    blend, rate, curve = minimum_jerk(s / HORIZONTAL_SHARE)
    for i in range(2):
        way = goal[i] - lift[i]
        p[i], v[i], a[i] = lift[i] + blend * way, rate * way / T, curve * way / T**2
    T = 0.5 * duration
    if s < 0.5:
        blend, rate, curve = minimum_jerk(2.0 * s)
        low, way = lift[2], ground + apex - lift[2]
    else:
        blend, rate, curve = minimum_jerk(2.0 * s - 1.0)
        low, way = ground + apex, -apex - TOUCHDOWN_DEPTH
    p[2], v[2], a[2] = low + blend * way, rate * way / T, curve * way / T**2
