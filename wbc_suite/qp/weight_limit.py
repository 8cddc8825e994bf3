"""Keep the torque of gravity within the efforts of motors."""

from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_number
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.limit import LimitKind, RowLimit
from wbc_suite.typing import Indices, Matrix, Vector

RATE = 5.0  # 1/s; how fast what is left of the effort may be used up
RETURN = 0.1  # of the effort per second, from beyond the limit


class WeightLimit(RowLimit):
    """Keep the torque that gravity asks of some motors within their efforts.

    With g(q) the generalised gravity, two rows for each joint i,

        -+ (dg_i / dq) v <= rate (limit_i +- g_i).

    Args:
        torques: Greatest torque or force of each joint by name, N m or N.

    Raises:
        ConfigError: If a limit is not positive.
    """

    kind = LimitKind.EFFORT
    unit = "N m"

    def __init__(self, torques: Mapping[str, float]) -> None:
        for name, value in torques.items():
            check_number(f"WeightLimit: '{name}'", value, above=0.0)
        self.names = tuple(torques)
        self._torques: Vector = np.array(list(torques.values()), dtype=np.float64)
        self.dim = 2 * len(self.names)

    def bind(self, configuration: Configuration) -> None:
        """Resolve the joints."""
        joints = [configuration.joint_id(name) for name in self.names]
        self._index: Indices = np.array(
            [configuration.model.joints[j].idx_v for j in joints], dtype=np.int64
        )

    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write two rows per joint: upper, then lower."""
        model, data, q = configuration.model, configuration.data, configuration.q
        slope = pin.computeGeneralizedGravityDerivatives(model, data, q)[self._index]
        torque = pin.computeGeneralizedGravity(model, data, q)[self._index]
        count = len(self.names)
        G[:count], G[count:] = slope, -slope
        room = np.concatenate([self._torques - torque, self._torques + torque])
        h[:] = dt * np.maximum(RATE * room, -RETURN * np.tile(self._torques, 2))

    def subject(self, row: int) -> str:
        """Return which motor carries all it can."""
        return f"{self.names[row % len(self.names)]} carries all it can"
