"""Ask the simulator whether a robot would touch something."""

import mujoco

from wbc_suite.control.state import RobotState
from wbc_suite.kinematics import Conversion
from wbc_suite.typing import Vector

__all__ = ["CollisionCheck"]

DEPTH = 1e-3
"""m; shallower contacts are no collision."""


class CollisionCheck:
    """Tells whether a configuration is free of contacts that are not there now.

    Works on a copy of the simulation's state.

    Args:
        state: The robot in the simulation.
        conversion: Conversion of the configurations that will be asked about.
    """

    def __init__(self, state: RobotState, conversion: Conversion) -> None:
        self._state, self._conversion = state, conversion
        self._data = mujoco.MjData(state.model)

    def is_free(self, q: Vector) -> bool:
        """Whether the robot could be at q without touching more than it does."""
        scene, data = self._state.data, self._data
        present = _pairs(scene, deeper_than=0.0)
        data.qpos[:] = scene.qpos
        self._conversion.q_to_mujoco(q, data.qpos)
        mujoco.mj_fwdPosition(self._state.model, data)
        return _pairs(data, deeper_than=DEPTH) <= present


def _pairs(data: mujoco.MjData, *, deeper_than: float) -> set[tuple[int, int]]:
    deep = data.contact.dist < -deeper_than
    return {(int(a), int(b)) for a, b in data.contact.geom[deep]}
