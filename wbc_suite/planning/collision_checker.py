"""Collision checkers: the clearance of a robot's configuration, in metres.

A planner asks `clearance(q)`: positive where nothing touches, by how much where that is
known, and at most zero in collision.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.kinematics import Configuration, Conversion
from wbc_suite.qp import FloorLimit, SelfCollisionLimit, WeightLimit
from wbc_suite.typing import Matrix, Vector

Clearance: TypeAlias = Callable[[Vector], float]
"""Maps a configuration, shape (nq,), to a clearance, m."""

DEPTH, OWN_DEPTH = 1e-3, 1e-4
"""m; shallower contacts are no collision; the second between two links of a robot,
which hold each other back."""


class SceneCollisionChecker:
    """Checks a robot against all geoms of a MuJoCo scene, and against itself.

    Works on a copy of the scene's state. Contacts that the scene has already are
    ignored, such as those of feet on the floor or of a held object; those between two
    links of a robot only as deep as they are. The conversion is that of the
    configurations that will be checked.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, conversion: Conversion
    ) -> None:
        self._model, self._scene, self._conversion = model, data, conversion
        self._data = mujoco.MjData(model)
        self._root = model.body_rootid[model.geom_bodyid].tolist()

    def clearance(self, q: Vector) -> float:
        """Return the distance of the deepest new contact from a collision, m.

        It is infinite without a contact; q has the shape (nq,).
        """
        scene, data = self._scene, self._data
        data.qpos[:] = scene.qpos
        data.mocap_pos[:], data.mocap_quat[:] = scene.mocap_pos, scene.mocap_quat
        self._conversion.q_to_mujoco(q, data.qpos)
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_collision(self._model, data)
        if not data.ncon:
            return np.inf
        present: dict[tuple[int, int], float] = {}
        for pair, depth in _contacts(scene):
            if depth < 0.0:
                present[pair] = min(depth, present.get(pair, 0.0))
        least = np.inf
        for pair, depth in _contacts(data):
            if self._root[pair[0]] == self._root[pair[1]]:
                least = min(least, depth - present.get(pair, 0.0) + OWN_DEPTH)
            elif pair not in present:
                least = min(least, depth + DEPTH)
        return least


def _contacts(data: mujoco.MjData) -> Iterator[tuple[tuple[int, int], float]]:
    """Yield the two geoms and the distance of each contact, m."""
    pairs = map(tuple, data.contact.geom.tolist())
    yield from zip(pairs, data.contact.dist.tolist(), strict=True)


class LimitChecker:
    """Checks what limits of a QP keep: distances of links, and the weight on motors.

    The limits are bound to a configuration of the checker's own.
    """

    def __init__(
        self,
        model: pin.Model,
        distances: Sequence[SelfCollisionLimit | FloorLimit],
        weights: Sequence[WeightLimit] = (),
    ) -> None:
        self._configuration = Configuration(model)
        self.distances, self._weights = tuple(distances), tuple(weights)
        for limit in (*self.distances, *self._weights):
            limit.bind(self._configuration)
        rows = max((limit.dim for limit in self.distances), default=0)
        self._G: Matrix = np.zeros((rows, self._configuration.nv))
        self._h: Vector = np.zeros(rows)

    def clearance(self, q: Vector) -> float:
        """Return the least distance beyond a limit's margin at q (nq,), m.

        It is infinite where all links are beyond the limits' influence. Where motors
        cannot hold the weight it is below zero, by what they lack, N m or N.
        """
        self._configuration.update(q)
        least = np.inf
        for limit in self._weights:
            room = float(limit.room(self._configuration).min())
            least = room if room <= 0.0 else least
        for limit in self.distances:
            G, h = self._G[: limit.dim], self._h[: limit.dim]
            limit.rows(self._configuration, 1.0, G, h)
            least = min(least, float(limit.distances.min()) - limit.margin)
        return least
