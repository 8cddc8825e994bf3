"""Where a controlled frame is in the simulation."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco
import pinocchio as pin

from wbc_suite.errors import UnknownNameError
from wbc_suite.viewers.limb import LimbKind

__all__ = ["FrameReader", "frame_readers"]


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
    layout: Any,
    model: mujoco.MjModel,
) -> dict[str, FrameReader]:
    """Return a reader for every slice of the action that commands a pose."""
    kinds = {str(kind) for kind in LimbKind}
    return {
        s.name: _reader(model, LimbKind(s.kind), "robot0_" + s.name)
        for s in layout.slices
        if s.kind in kinds
    }


def _reader(model: mujoco.MjModel, kind: LimbKind, name: str) -> FrameReader:
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
    if site >= 0:
        body = int(model.site_bodyid[site])
        return FrameReader(
            kind,
            body,
            lambda d: pin.SE3(d.site_xmat[site].reshape(3, 3), d.site_xpos[site]),
        )
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    if body >= 0:
        return FrameReader(
            kind, body, lambda d: pin.SE3(d.xmat[body].reshape(3, 3), d.xpos[body])
        )
    known = [model.site(k).name for k in range(model.nsite)]
    raise UnknownNameError("controlled frame", name, known)
