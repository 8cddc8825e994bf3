"""An object in a simulation: its pose, size and bounding cylinder."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from wbc_suite.robot.poses import pose_at
from wbc_suite.scene.geom_bounds import solid_geoms, support
from wbc_suite.scene.objects.scene_object import STANDING, Quat, SceneObject
from wbc_suite.typing import Matrix, Vector

DIRECTIONS = 64
"""Horizontal directions along which an object is measured; 0.1 % below the circle."""

STILL, STILL_TURN = 0.02, 0.2
"""m/s and rad/s, of things that lie still."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Extent:
    """Upright bounding cylinder of an object, from `bottom` below its origin, m."""

    radius: float
    bottom: float
    top: float


class ObjectState:
    """One body of a compiled scene.

    Attributes:
        body: Its index.
        geoms: Its solid geoms, and those of its children.
        position: Position of its origin in the world, m. A view.
        rotation: Rotation R_wb of its frame, shape (3, 3). A view.
        joints: Positions of its hinges and slides, rad or m; empty for others. A view.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, name: str) -> None:
        self.model, self.data, self.name = model, data, name
        self.body: int = model.body(name).id
        solid, under = solid_geoms(model), _bodies_under(model, self.body)
        own = solid[under[model.geom_bodyid[solid]]]
        self.geoms = frozenset(own.tolist())
        self.position: Vector = data.xpos[self.body]
        self.rotation: Matrix = data.xmat[self.body].reshape(3, 3)
        joint, count = model.body_jntadr[self.body], model.body_jntnum[self.body]
        free = mujoco.mjtJoint.mjJNT_FREE
        self._q = self._v = -1
        if joint >= 0 and model.jnt_type[joint] == free:
            self._q = int(model.jnt_qposadr[joint])
            self._v = int(model.jnt_dofadr[joint])
        first = int(model.jnt_qposadr[joint]) if count else 0
        count = 0 if self.is_free else count
        self.joints: Vector = data.qpos[first : first + count]

    @property
    def is_free(self) -> bool:
        """Whether it has a free joint."""
        return self._q >= 0

    @property
    def weight(self) -> float:
        """Its weight, N."""
        gravity = float(np.linalg.norm(self.model.opt.gravity))
        return self.model.body_subtreemass.item(self.body) * gravity

    @property
    def is_still(self) -> bool:
        """Whether it moves less than 0.02 m/s and 0.2 rad/s; fixed ones do not move."""
        v = self.data.qvel[self._v : self._v + 6] if self.is_free else np.zeros(6)
        return math.hypot(*v[:3]) < STILL and math.hypot(*v[3:]) < STILL_TURN

    def move(self, position: Sequence[float], quat: Quat = STANDING) -> None:
        """Write its pose, at rest; the simulation is not updated."""
        if self._q < 0:
            self.model.body_pos[self.body] = position
            self.model.body_quat[self.body] = quat
            return
        q, v = self.data.qpos, self.data.qvel
        q[self._q : self._q + 3] = position
        q[self._q + 3 : self._q + 7] = quat
        v[self._v : self._v + 6] = 0.0

    def reshape(self, changed: SceneObject) -> None:
        """Write the object with other sizes of its parts into the compiled model.

        All values, bounds of the broadphase and inertia too, are those that the
        compiler computes for the object alone. An object fixed to another body must
        keep its mass.
        """
        model, alone, body = self.model, changed.compiled_alone(), self.body
        for array, first, count in (
            ("geom", model.body_geomadr[body], alone.ngeom),
            ("site", np.searchsorted(model.site_bodyid, body), alone.nsite),
            ("bvh", model.body_bvhadr[body], alone.body_bvhnum[1]),
        ):
            for field in _SHAPE_FIELDS[array]:
                getattr(model, field)[first : first + count] = getattr(alone, field)
        first = model.body_bvhadr[body]
        nodes = model.bvh_nodeid[first : first + alone.body_bvhnum[1]]
        nodes[nodes >= 0] += model.body_geomadr[body]
        for field in _BODY_FIELDS:
            getattr(model, field)[body] = getattr(alone, field)[1]
        if self.is_free:
            model.body_invweight0[body] = alone.body_invweight0[1]
            model.dof_invweight0[self._v : self._v + 6] = alone.dof_invweight0
            model.dof_M0[self._v : self._v + 6] = alone.dof_M0

    def extent(self, quat: Quat = STANDING) -> Extent:
        """Return the extent of its present solid geoms when it is turned by `quat`."""
        R = pose_at((0.0, 0.0, 0.0), quat).rotation
        angles = np.linspace(0.0, 2 * np.pi, DIRECTIONS, endpoint=False)
        flat = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(DIRECTIONS)])
        ways = np.vstack([flat, (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)]) @ R
        model = self.model
        reach = np.full(len(ways), -np.inf)
        for geom in self.geoms:
            if model.geom_bodyid[geom] == self.body:
                place = pose_at(model.geom_pos[geom], model.geom_quat[geom])
                own = support(model, geom, ways @ place.rotation)
                reach = np.maximum(reach, ways @ place.translation + own)
        return Extent(
            radius=float(reach[:-2].max()),
            bottom=float(reach[-2]),
            top=float(reach[-1]),
        )


_SHAPE_FIELDS = {
    "geom": ("geom_pos", "geom_quat", "geom_size", "geom_aabb", "geom_rbound"),
    "site": ("site_pos",),
    "bvh": ("bvh_aabb", "bvh_child", "bvh_depth", "bvh_nodeid"),
}
_BODY_FIELDS = (
    *("body_mass", "body_subtreemass", "body_inertia"),
    *("body_ipos", "body_iquat"),
)


def _bodies_under(model: mujoco.MjModel, body: int) -> np.ndarray:
    """Mark a body and its descendants, shape (nbody,)."""
    marked = np.zeros(model.nbody, dtype=bool)
    marked[body] = True
    for child in range(body + 1, model.nbody):
        marked[child] |= marked[model.body_parentid[child]]
    return marked
