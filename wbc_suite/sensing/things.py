"""Things of an arena: readings of their poses and joints, and room for robots."""

from collections.abc import Sequence

import mujoco
import numpy as np

from wbc_suite.control import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.scene import ArenaConfig
from wbc_suite.scene.mjcf_arena import PREFIX
from wbc_suite.sensing.reading import (
    Reading,
    body_position,
    body_quat,
    joint_positions,
)

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
