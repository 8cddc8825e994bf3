"""The approach of a goal in NumPy: the oracle of the compiled form."""

import numpy as np
import pinocchio as pin


def approach_speed(distance, *, rate, speed, acceleration):
    """Return `sqrt(2 a d + (a / k)^2) - a / k`, at most a speed; k in 1/s."""
    corner = np.asarray(acceleration) / rate
    parabola = np.sqrt(2.0 * np.asarray(acceleration) * distance + corner**2)
    return np.minimum(parabola - corner, speed)


def approach_posture(difference, *, dt, speed, acceleration):
    """Return joint velocities that remove a difference; dt is the time constant, s."""
    wanted = approach_speed(
        np.abs(difference), rate=1.0 / dt, speed=speed, acceleration=acceleration
    )
    return np.sign(difference) * wanted


def approach_pose(now, goal, *, dt, gain, speed, acceleration):
    """Return the pose on the way whose error, times the gain, is a feasible step."""
    offset = goal.translation - now.translation
    turn = pin.log3(now.rotation.T @ goal.rotation)
    steps = []
    for error, v, a in zip((offset, turn), speed, acceleration, strict=True):
        distance = np.linalg.norm(error)
        wanted = approach_speed(distance, rate=gain / dt, speed=v, acceleration=a)
        steps.append(error * min(1.0, wanted * dt / (gain * max(distance, 1e-300))))
    offset, turn = steps
    return pin.SE3(now.rotation @ pin.exp3(turn), now.translation + offset)
