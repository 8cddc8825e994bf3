"""Things of an arena: their readings, room for robots, and free views."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.robot.poses import pose_at, pose_fields
from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene import ArenaConfig
from wbc_suite.scene.mjcf_arena import PREFIX
from wbc_suite.sensing.reading import (
    Reading,
    body_position,
    body_quat,
    joint_positions,
)
from wbc_suite.typing import Vector

ABOVE = 0.15  # height over a surface of the point that cameras must see, m
DEEPEST = 1e-3  # of robots in the arena at their start, m


def readings_of_things(arena: ArenaConfig, m: mujoco.MjModel) -> dict[str, Reading]:
    """Return `{thing}_joint` of bodies on hinges and slides, rad and m.

    Others have `{thing}_pos` in the world, m, and `{thing}_quat`, x y z w.
    """
    turning = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
    readings: dict[str, Reading] = {}
    for name in arena.thing_names(m):
        body = m.body(PREFIX + name).id
        joints = slice(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body])
        if np.isin(m.jnt_type[joints], turning).all():
            readings[f"{name}_joint"] = joint_positions(m.jnt_qposadr[joints].tolist())
        else:
            readings[f"{name}_pos"] = body_position(body)
            readings[f"{name}_quat"] = body_quat(body)
    return readings


def check_room(arena: ArenaConfig, robots: Sequence[RobotState]) -> None:
    """Check that no robot is in the arena now.

    Raises:
        ConfigError: Names what it is in.
    """
    if not robots:
        return
    m, data = robots[0].model, robots[0].data
    prefixes = tuple(robot.prefix for robot in robots)
    for pair in data.contact.geom[data.contact.dist < -DEEPEST].tolist():
        for own, other in (pair, pair[::-1]):
            body, found = m.body(m.geom_bodyid[own]).name, m.geom(other).name
            if body.startswith(prefixes) and found.startswith(PREFIX):
                raise ConfigError(
                    f"{arena.file}: at its start '{body}' is in "
                    f"'{found.removeprefix(PREFIX)}'. Give another `surface`, or `at` "
                    "and `yaw`."
                )


def clear_views(m: mujoco.MjModel, data: mujoco.MjData, center: Vector3) -> None:
    """Turn the benchmark's cameras about the vertical through a point till they see it.

    They look from in front of a table, where the walls of a room may be.
    """
    middle = np.array(center) + np.array([0.0, 0.0, ABOVE])
    for camera in np.flatnonzero(m.cam_bodyid == 0):
        if m.camera(camera).name.startswith(PREFIX):
            continue
        place = pose_at(m.cam_pos[camera], m.cam_quat[camera])
        for step in sorted(range(-5, 7), key=abs):
            R = pin.utils.rotate("z", step * math.pi / 6)
            eye = middle + R @ (place.translation - middle)
            if not _is_hidden(m, data, eye, middle):
                pose = pose_fields(pin.SE3(R @ place.rotation, eye))
                m.cam_pos[camera], m.cam_quat[camera] = pose["pos"], pose["quat"]
                break


def _is_hidden(
    m: mujoco.MjModel, data: mujoco.MjData, eye: Vector, middle: Vector
) -> bool:
    """Whether the arena hides a point from an eye, or the eye from the point."""
    hit = np.zeros(1, dtype=np.int32)
    for start, end in ((eye, middle), (middle, eye)):
        share = mujoco.mj_ray(m, data, start, end - start, None, True, -1, hit)
        found = m.geom(hit[0]).name if hit[0] >= 0 else ""
        if 0.0 <= share < 1.0 and found.startswith(PREFIX):
            return True
    return False
