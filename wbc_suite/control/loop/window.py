"""The window of accelerations in which a joint keeps its limits."""

import numpy as np

from wbc_suite.compiling import inlined
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.table import CompiledRecords

__all__ = ["RATE", "keep_window", "window"]

RATE = 50.0
"""1/s; a limit is approached, and left when it was overrun, no faster than this."""


@inlined
def keep_window(
    physics: Physics, law: CompiledRecords, drives: CompiledRecords
) -> None:
    """Take a law's accelerations back to what `Law.within_limits` allows."""
    for j in range(law.first, law.last):
        dof = drives[j].dof
        lower, upper = window(physics, drives[j])
        physics.acceleration[dof] = max(min(physics.acceleration[dof], upper), lower)


@inlined
def window(physics: Physics, drive: CompiledRecords) -> tuple[float, float]:
    """Return the least and the greatest acceleration of a joint."""
    q, v = float(physics.qpos[drive.qpos]), float(physics.qvel[drive.dof])
    upper = _most(drive.highest - q, v, drive.fastest, drive.braking)
    lower = -_most(q - drive.lowest, -v, drive.fastest, drive.braking)
    return lower, upper


@inlined
def _most(distance: float, speed: float, fastest: float, braking: float) -> float:
    """Return the greatest acceleration towards a limit."""
    corner = braking / RATE
    if 2.0 * braking * distance >= fastest * (fastest + 2.0 * corner):
        return RATE * (fastest - speed)  # far away: spares most joints the root
    if distance <= 0.0:
        allowed, slope = max(RATE * distance, -fastest), RATE
    else:
        root = np.sqrt(2.0 * braking * distance + corner * corner)
        allowed, slope = root - corner, braking / root
    if abs(allowed) >= fastest:
        allowed, slope = np.copysign(fastest, allowed), 0.0
    return RATE * (allowed - speed) - slope * speed
