"""Ask the simulator whether a robot would touch something."""

import mujoco
import numpy as np

from wbc_suite.control.state import RobotState
from wbc_suite.kinematics import Conversion
from wbc_suite.typing import Vector

__all__ = ["CollisionCheck"]

DEPTH = 1e-3
"""m; shallower contacts are no collision."""


class CollisionCheck:
    """Tells how a configuration is free of contacts that are not there now.

    Works on a copy of the simulation's state.

    Args:
        state: The robot in the simulation.
        conversion: Conversion of the configurations that will be asked about.
    """

    def __init__(self, state: RobotState, conversion: Conversion) -> None:
        self._state, self._conversion = state, conversion
        self._data = mujoco.MjData(state.model)

    def room(self, q: Vector) -> float:
        """Return how far contacts at q are from being deep, m; inf without any.

        Contacts that are there now do not count.
        """
        scene, data = self._state.data, self._data
        data.qpos[:] = scene.qpos
        self._conversion.q_to_mujoco(q, data.qpos)
        mujoco.mj_kinematics(self._state.model, data)
        mujoco.mj_collision(self._state.model, data)
        if not data.ncon:
            return np.inf
        touching = scene.contact.geom[scene.contact.dist < 0.0]
        present = {(int(a), int(b)) for a, b in touching}
        found = zip(data.contact.geom.tolist(), data.contact.dist, strict=True)
        new = [float(dist) for (a, b), dist in found if (a, b) not in present]
        return min(new, default=np.inf) + DEPTH
