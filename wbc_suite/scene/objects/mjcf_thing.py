"""Things from a user's own MJCF file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import mujoco

from wbc_suite.errors import DescriptionError
from wbc_suite.robot.mjcf_files import read_mjcf_spec
from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene.objects.thing import STANDING, Quat

__all__ = ["MjcfThing"]


@dataclass(frozen=True, kw_only=True, slots=True)
class MjcfThing:
    """The one body below the world of an MJCF file, with all that hangs on it.

    The file is read with care: its size is limited, it names no file outside its own
    folder, and it brings no plugins. Its names get `{name}_` before them.

    Attributes:
        name: Name of the body in the scene.
        path: The file.
        motion: `free` or `fixed`; joints of the body itself are left out.
        pos: Where it is in the scene, m.
        quat: How it is turned there, w x y z.
    """

    name: str
    path: Path
    motion: Literal["free", "fixed"] = "free"
    pos: Vector3 = (0.0, 0.0, 0.0)
    quat: Quat = STANDING

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add it to a scene.

        Raises:
            ConfigError: If the file is no MJCF, or names a file outside its folder.
            DescriptionError: If MuJoCo refuses it, or it holds not exactly one body.
        """
        own = read_mjcf_spec(self.path)
        bodies = own.worldbody.bodies
        if len(bodies) != 1:
            raise DescriptionError(
                f"{self.path}: an object is one body below <worldbody>, not "
                f"{len(bodies)}; put what belongs together into one body."
            )
        (body,) = bodies
        for joint in list(body.joints):
            own.delete(joint)
        for key in list(own.keys):
            own.delete(key)
        if not body.name:
            body.name = self.name
        frame = spec.worldbody.add_frame()
        added = frame.attach_body(body, f"{self.name}_", "")
        added.name, added.pos, added.quat = self.name, self.pos, self.quat
        if self.motion == "free":
            kind = mujoco.mjtJoint.mjJNT_FREE
            added.add_joint(name=f"{self.name}_joint", type=kind)
