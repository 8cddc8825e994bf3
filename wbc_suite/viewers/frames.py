"""Where the controlled frames of a whole-body controller are in the simulation."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.errors import ConfigError
from wbc_suite.viewers.limb import LimbKind

__all__ = ["FrameReader", "frame_readers"]

PREFIX = "robot0_"
_KINDS = {
    "pose": LimbKind.POSE,
    "position": LimbKind.POSITION,
    "orientation": LimbKind.ORIENTATION,
    "com": LimbKind.POSITION,
    "base": LimbKind.PLANAR,
}


@dataclass(frozen=True, slots=True)
class FrameReader:
    """Reads the pose of one controlled frame from MuJoCo's data.

    Attributes:
        kind: Which part of the pose the controller commands.
        body: Body that the frame is fixed to; -1 when it is fixed to none.
        pose: Gives the pose in the world from an `MjData`.
    """

    kind: LimbKind
    body: int
    pose: Callable[[mujoco.MjData], pin.SE3]


def frame_readers(
    controller: Any,
    model: mujoco.MjModel,
) -> dict[str, FrameReader]:
    """Return a reader for every controlled frame, by the name of its action slice.

    Args:
        controller: Whole-body controller; its `config` names the frames.
        model: Scene in which the robot is the first one.

    Raises:
        ConfigError: If the controller takes no absolute targets in the world.
    """
    config = getattr(controller, "config", None)
    taken = [getattr(config, key, None) for key in ("input_type", "input_ref_frame")]
    if config is None or taken != ["absolute", "world"]:
        raise ConfigError(
            "Teleoperation needs a whole-body controller with input_type 'absolute' "
            f"and input_ref_frame 'world', not {type(controller).__name__} with "
            f"{taken[0]!r} and {taken[1]!r}."
        )
    return {
        frame.name: _reader(model, _KINDS[frame.kind], frame.frame)
        for frame in config.frames
    }


def _reader(model: mujoco.MjModel, kind: LimbKind, frame: str | None) -> FrameReader:
    if frame is None:
        root = _root_body(model)
        return FrameReader(
            kind, -1, lambda d: pin.SE3(np.eye(3), d.subtree_com[root].copy())
        )
    name = PREFIX + frame
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
    if site < 0:
        body = model.body(name).id
        return FrameReader(
            kind, body, lambda d: pin.SE3(d.xmat[body].reshape(3, 3), d.xpos[body])
        )
    return FrameReader(
        kind,
        int(model.site_bodyid[site]),
        lambda d: pin.SE3(d.site_xmat[site].reshape(3, 3), d.site_xpos[site]),
    )


def _root_body(model: mujoco.MjModel) -> int:
    """Return the robot's first body; all others of it hang on it."""
    return next(b for b in range(model.nbody) if model.body(b).name.startswith(PREFIX))
