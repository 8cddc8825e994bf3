"""Collision checkers: the clearance of a robot's configuration, in metres.

A planner asks `clearance(q)`: positive where nothing touches, by how much where that is
known, and at most zero in collision.
"""

from collections.abc import Callable, Sequence
from typing import TypeAlias

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.kinematics import Configuration, Conversion
from wbc_suite.qp import FloorLimit, SelfCollisionLimit
from wbc_suite.typing import Matrix, Vector

Clearance: TypeAlias = Callable[[Vector], float]
"""Maps a configuration, shape (nq,), to a clearance, m."""

DEPTH = 1e-3  # m; shallower contacts are no collision


class SceneCollisionChecker:
    """Checks a robot against all geoms of a MuJoCo scene, and against itself.

    Works on a copy of the scene's state. Contacts that the scene has already are
    ignored, such as those of feet on the floor. The conversion is that of the
    configurations that will be checked.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, conversion: Conversion
    ) -> None:
        self._model, self._scene, self._conversion = model, data, conversion
        self._data = mujoco.MjData(model)

    def clearance(self, q: Vector) -> float:
        """Return the distance of the deepest new contact from a collision, m.

        It is infinite without a contact. Contacts up to 1 mm deep are no collision.
        """
        scene, data = self._scene, self._data
        data.qpos[:] = scene.qpos
        data.mocap_pos[:], data.mocap_quat[:] = scene.mocap_pos, scene.mocap_quat
        self._conversion.q_to_mujoco(q, data.qpos)
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_collision(self._model, data)
        if not data.ncon:
            return np.inf
        touching = scene.contact.geom[scene.contact.dist < 0.0]
        present = {(int(a), int(b)) for a, b in touching}
        found = zip(data.contact.geom.tolist(), data.contact.dist, strict=True)
        new = [float(dist) for (a, b), dist in found if (a, b) not in present]
        return min(new, default=np.inf) + DEPTH


class LinkDistanceChecker:
    """Checks the distances that the distance limits of a QP keep.

    The limits are bound to a configuration of the checker's own.
    """

    def __init__(
        self, model: pin.Model, limits: Sequence[SelfCollisionLimit | FloorLimit]
    ) -> None:
        self._configuration = Configuration(model)
        self.limits = tuple(limits)
        for limit in self.limits:
            limit.bind(self._configuration)
        rows = max((limit.dim for limit in self.limits), default=0)
        self._G: Matrix = np.zeros((rows, self._configuration.nv))
        self._h: Vector = np.zeros(rows)

    def clearance(self, q: Vector) -> float:
        """Return the least distance beyond a limit's margin, m.

        It is infinite where all links are beyond the limits' influence.
        """
        self._configuration.update(q)
        least = np.inf
        for limit in self.limits:
            G, h = self._G[: limit.dim], self._h[: limit.dim]
            limit.rows(self._configuration, 1.0, G, h)
            least = min(least, float(limit.distances.min()) - limit.margin)
        return least
