"""One thing that a person can hold: a hand, a foot, the head, the base."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from wbc_suite.devices.limbs import LimbKind
from wbc_suite.devices.pipeline.limb import LimbPipeline

__all__ = ["Limb", "Ownership"]

HOLD_TIMEOUT = 20.0  # s; a frozen tab may keep a limb for this long, not longer


class Ownership:
    """Who holds something that only one client may move at a time.

    The first to take it holds it until they release it, or until they have been
    silent for `timeout` seconds.
    """

    def __init__(self, timeout: float = HOLD_TIMEOUT) -> None:
        self.timeout = timeout
        self._holder: int | None = None
        self._last_sign = 0.0

    def holder(self, now: float) -> int | None:
        """Return the client that holds it at time `now`, or None."""
        if self._holder is not None and now - self._last_sign > self.timeout:
            self._holder = None
        return self._holder

    def take(self, client: int, now: float) -> bool:
        """Take or keep it; False when another client holds it."""
        if self.holder(now) not in (None, client):
            return False
        self._holder, self._last_sign = client, now
        return True

    def release(self, client: int) -> bool:
        """Give it back; False when this client was not the holder."""
        if self._holder != client:
            return False
        self._holder = None
        return True


@dataclass(slots=True)
class Limb:
    """A limb of the pipeline that several people may want to move.

    Attributes:
        stages: What makes its targets of people's input.
        ownership: Which client holds the limb.
        enabled: Whether the limb listens to anybody at all.
    """

    stages: LimbPipeline
    ownership: Ownership
    enabled: bool = True

    @property
    def kind(self) -> LimbKind:
        """Which part of a pose is commanded."""
        return self.stages.port.kind

    @property
    def asked(self) -> pin.SE3:
        """The pose that people ask for, which the target heads for."""
        return self.stages.clutch.target

    def seen_target(self, measured: pin.SE3) -> pin.SE3:
        """Return the target, with what it does not command as it is measured."""
        target = self.asked
        match self.kind:
            case LimbKind.POSE:
                return target
            case LimbKind.POSITION:
                return pin.SE3(measured.rotation, target.translation)
            case LimbKind.ORIENTATION:
                return pin.SE3(target.rotation, measured.translation)
            case LimbKind.PLANAR:
                height = np.array([0.0, 0.0, measured.translation[2]])
                height[:2] = target.translation[:2]
                return pin.SE3(target.rotation, height)
