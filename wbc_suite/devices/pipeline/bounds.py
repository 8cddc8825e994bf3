"""Where a target may be: within a box, and within a leash of its limb."""

from typing import Protocol

import numpy as np
import pinocchio as pin

__all__ = ["Bound", "LeashBound", "WorkspaceBound"]

NEAR = 1e-9  # m or rad


class Bound(Protocol):
    """A stage that keeps a target somewhere.

    Attributes:
        acting: What it does, in words; empty when it lets the target pass.
    """

    acting: str

    def apply(self, target: pin.SE3, measured: pin.SE3) -> pin.SE3:
        """Return the nearest target that is allowed; the same one if it is.

        Args:
            target: What is asked for, in the world.
            measured: Where the limb is.
        """
        ...


class WorkspaceBound:
    """Keeps positions within a box.

    Args:
        low: Least coordinates, m.
        high: Greatest coordinates, m.
    """

    def __init__(
        self, low: tuple[float, float, float], high: tuple[float, float, float]
    ) -> None:
        self._low, self._high = np.array(low), np.array(high)
        self.acting = ""

    def apply(self, target: pin.SE3, measured: pin.SE3) -> pin.SE3:
        """Clip the position."""
        inside = np.clip(target.translation, self._low, self._high)
        at_edge = np.minimum(inside - self._low, self._high - inside).min() < NEAR
        self.acting = "at the edge of its workspace" if at_edge else ""
        return pin.SE3(target.rotation, inside)


class LeashBound:
    """Keeps a target within reach of its limb, so that nothing winds up.

    Args:
        distance: By how much it may lead, m.
        angle: By how much it may be turned, rad.
    """

    def __init__(self, distance: float, angle: float) -> None:
        self._distance, self._angle = distance, angle
        self.acting = ""

    def apply(self, target: pin.SE3, measured: pin.SE3) -> pin.SE3:
        """Pull the target towards the limb as far as needed."""
        away = target.translation - measured.translation
        turn = pin.log3(target.rotation @ measured.rotation.T)
        far, wide = float(np.linalg.norm(away)), float(np.linalg.norm(turn))
        shorter, less = (
            min(1.0, self._distance / max(far, NEAR)),
            min(1.0, self._angle / max(wide, NEAR)),
        )
        self.acting = (
            "leash is tight"
            if far > self._distance - NEAR or wide > self._angle - NEAR
            else ""
        )
        if min(shorter, less) == 1.0:
            return target
        rotation = (
            target.rotation
            if less == 1.0
            else pin.exp3(less * turn) @ measured.rotation
        )
        return pin.SE3(rotation, measured.translation + shorter * away)
