"""Readings of the things in an arena."""

import mujoco
import numpy as np

from wbc_suite.scene import ArenaConfig
from wbc_suite.scene.mjcf_arena import PREFIX
from wbc_suite.sensing.reading import (
    Reading,
    body_position,
    body_quat,
    joint_positions,
)


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
