"""The one-euro filter: a low-pass filter with a cutoff that rises with speed."""

import math

import numpy as np
import pinocchio as pin

from wbc_suite.devices.pipeline.config import OneEuro

SPEED_CUTOFF = 1.0  # Hz, of the speed's own filter, as in the source


class OneEuroFilter:
    """Low-pass filter of a pose with a cutoff that rises with its speed.

        cutoff = cutoff_0 + rise * speed,   alpha = 1 / (1 + 1 / (2 pi cutoff dt))

    Orientations are filtered along the shortest arc.

    Source: Casiez, Roussel and Vogel (2012), "1 Euro Filter", CHI.

    Args:
        config: Cutoffs.
        dt: Time between two ticks, s.
    """

    def __init__(self, config: OneEuro, dt: float) -> None:
        self._config, self._dt = config, dt
        self.reset(pin.SE3.Identity())

    def reset(self, pose: pin.SE3) -> None:
        """Start at rest at a pose."""
        self._pose, self._before = pose.copy(), pose.copy()
        self._speed = np.zeros(2)

    def apply(self, target: pin.SE3) -> pin.SE3:
        """Return the smoothed target."""
        moved = target.translation - self._before.translation
        turned = pin.log3(target.rotation @ self._before.rotation.T)
        speed = np.array([np.linalg.norm(moved), np.linalg.norm(turned)]) / self._dt
        self._speed += self._alpha(SPEED_CUTOFF) * (speed - self._speed)
        self._before = target.copy()
        config = self._config
        linear = self._alpha(config.cutoff + config.linear_rise * self._speed[0])
        angular = self._alpha(config.cutoff + config.angular_rise * self._speed[1])
        here = self._pose
        offset = target.translation - here.translation
        turn = pin.log3(target.rotation @ here.rotation.T)
        self._pose = pin.SE3(
            pin.exp3(angular * turn) @ here.rotation, here.translation + linear * offset
        )
        return self._pose

    def _alpha(self, cutoff: float) -> float:
        return 1.0 / (1.0 + 1.0 / (2.0 * math.pi * cutoff * self._dt))
