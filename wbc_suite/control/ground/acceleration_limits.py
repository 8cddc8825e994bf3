"""Joint accelerations that keep the limits of position and velocity."""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.records import Drive, Drives, LawRecord

RATE = 50.0
"""1/s; fastest exponential approach to a limit, and return from beyond it."""


@inner
def limit_accelerations(physics: Physics, law: LawRecord, drives: Drives) -> None:
    """Clip the accelerations that a law asks for to those that keep its limits."""
    for j in range(law.first, law.last):
        dof = drives[j].dof
        lower, upper = acceleration_limits(physics, drives[j])
        physics.acceleration[dof] = max(min(physics.acceleration[dof], upper), lower)


@inner
def acceleration_limits(physics: Physics, drive: Drive) -> tuple[float, float]:
    """Return the least and the greatest acceleration of a joint.

    At the distance d from a limit the velocity towards it may be

        u(d) = min(sqrt(2 b d + (b / r)^2) - b / r, velocity_max)

    so that the deceleration b stops the joint in time, with an exponential approach of
    rate r at the end. A joint on that curve has `v' = -u'(d) v`; any other tends to it
    at the rate r:

        v' <= r (u(d) - v) - u'(d) v.

    Beyond a limit u is r d, back inside.
    """
    q, v = float(physics.qpos[drive.qpos]), float(physics.qvel[drive.dof])
    upper = _greatest_acceleration(drive.position_max - q, v, drive)
    lower = -_greatest_acceleration(q - drive.position_min, -v, drive)
    return lower, upper


@inner
def _greatest_acceleration(distance: float, velocity: float, drive: Drive) -> float:
    """Return the greatest acceleration towards a limit."""
    velocity_max, deceleration = drive.velocity_max, drive.deceleration
    corner = deceleration / RATE
    if 2.0 * deceleration * distance >= velocity_max * (velocity_max + 2.0 * corner):
        return RATE * (velocity_max - velocity)  # far away, the common case
    if distance <= 0.0:
        allowed, slope = max(RATE * distance, -velocity_max), RATE
    else:
        root = np.sqrt(2.0 * deceleration * distance + corner * corner)
        allowed, slope = root - corner, deceleration / root
    if abs(allowed) >= velocity_max:
        allowed, slope = np.copysign(velocity_max, allowed), 0.0
    return RATE * (allowed - velocity) - slope * velocity
