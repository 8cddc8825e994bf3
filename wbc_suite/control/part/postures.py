"""Random postures."""

import numpy as np
import pinocchio as pin

from wbc_suite.typing import Vector

__all__ = ["random_posture"]


def random_posture(model: pin.Model, q: Vector, rng: np.random.Generator) -> Vector:
    """Return q with every limited joint anywhere within its limits."""
    drawn = q.copy()
    for joint in list(model.joints)[1:]:
        low = model.lowerPositionLimit[joint.idx_q]
        high = model.upperPositionLimit[joint.idx_q]
        if joint.nq == 1 and low < high < 1e6:
            drawn[joint.idx_q] = rng.uniform(low, high)
    return drawn
