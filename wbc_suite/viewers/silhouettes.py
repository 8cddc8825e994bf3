"""Silhouettes of models, by which two drawings of one robot are compared."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.robot import RobotDescription
from wbc_suite.sensing.renderer import HIDDEN_GROUP, make_renderer
from wbc_suite.typing import Vector

SIDES = {"front": 180.0, "side": 90.0, "oblique": 135.0}  # azimuth of the camera, deg
SIZE = 480  # pixels


def silhouettes(
    m: mujoco.MjModel, data: mujoco.MjData, at: Vector
) -> dict[str, NDArray[np.bool_]]:
    """Return the pixels of visual shapes by side, shape (SIZE, SIZE), around a point.

    The extent of the picture is the fourth number of `at`, m.
    """
    solid = (m.geom_contype | m.geom_conaffinity) > 0
    m.geom_group[:] = np.where(solid & (~solid).any(), HIDDEN_GROUP, 0)
    m.site_group[:] = HIDDEN_GROUP
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.elevation = at[:3], 1.3 * at[3], -15.0
    labels = np.ones(m.ngeom + 1, dtype=np.int32)
    labels[-1] = 0  # the background
    found: dict[str, NDArray[np.bool_]] = {}
    with make_renderer(m, width=SIZE, height=SIZE) as renderer:
        for side, azimuth in SIDES.items():
            camera.azimuth = azimuth
            renderer.update_scene(data, camera)
            renderer.draw_surfaces()
            found[side] = renderer.read_geoms(labels) > 0
    return found


def surroundings(m: mujoco.MjModel, data: mujoco.MjData) -> Vector:
    """Return the centre of a model and its extent, m, shape (4,)."""
    low = (data.geom_xpos - m.geom_rbound[:, None]).min(axis=0)
    high = (data.geom_xpos + m.geom_rbound[:, None]).max(axis=0)
    return np.array([*(low + high) / 2, np.linalg.norm(high - low)])


def overlap(one: RobotDescription, other: RobotDescription) -> dict[str, float]:
    """Return intersection over union of the silhouettes of two drawings, by side.

    Both have the same joints and stand at `ready`.
    """
    found: list[dict[str, NDArray[np.bool_]]] = []
    at = None
    for robot in (one, other):
        m = robot.to_mjspec().compile()
        data = mujoco.MjData(m)
        for joint, value in robot.keyframe("ready").items():
            data.joint(joint).qpos[:] = value
        mujoco.mj_forward(m, data)
        at = surroundings(m, data) if at is None else at
        found.append(silhouettes(m, data, at))
    return {
        side: float((a & b).sum() / max(1, (a | b).sum()))
        for side, a, b in ((side, *(f[side] for f in found)) for side in SIDES)
    }
