"""`RobotDescription`: a complete robot, and the exports to each engine."""

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, model_validator

from wbc_suite.config_files import parse_model
from wbc_suite.errors import DescriptionError, look_up
from wbc_suite.robot.elements import (
    Elements,
    Frame,
    Joint,
    Link,
    Name,
    Synergy,
    UrdfRoot,
)
from wbc_suite.robot.shapes import Drawn
from wbc_suite.robot.validation import check_description

if TYPE_CHECKING:
    from pathlib import Path

    import mujoco

_SIDES = {"right", "left"}


class RobotDescription(Elements):
    """A robot: links in depth-first order, joints, frames and the other elements.

    It is validated on construction: names are unique, inertias are physical, references
    resolve. The MuJoCo and the Pinocchio model built from it have the same joint names
    and one velocity index per joint, in the same order.

    Attributes:
        synergies: Gripper commands, by gripper.
        skins: Meshes drawn instead of a link's visual shapes, see `robot.skins`.
    """

    name: str
    title: str = ""
    source: str = ""
    license: str = ""
    deviations: tuple[str, ...] = ()
    synergies: dict[Name, tuple[Synergy, ...]] = {}
    skins: dict[Name, tuple[Drawn, ...]] = Field(default={}, exclude=True)

    @model_validator(mode="after")
    def _check(self) -> "RobotDescription":
        check_description(self, self.synergies)
        return self

    @property
    def root_joint_names(self) -> tuple[str, ...]:
        """Names of the root's joints: none, three (planar) or one (free)."""
        if self.root.kind == "free":
            return ("root",)
        return tuple(joint.name for joint in self.root.joints)

    @cached_property
    def dof(self) -> int:
        """Number of joints that follow no other, without the root."""
        return sum(joint.mimic is None for joint in self.joints)

    @cached_property
    def mass(self) -> float:
        """Total mass, kg."""
        return sum(link.mass for link in self.links)

    @cached_property
    def moving_mass(self) -> float:
        """Mass of the links that a joint or the root moves, kg: not of a pedestal."""
        moving = set[str]()
        for link in self.links:  # parents come first
            if link.parent is None:
                moves = self.root.kind != "fixed"
            else:
                moves = link.joint is not None or link.parent in moving
            moving |= {link.name} if moves else set()
        return sum(link.mass for link in self.links if link.name in moving)

    @property
    def weight_text(self) -> str:
        """The mass in words, such as `278.4 kg, 3.0 kg of which move`."""
        total, moving = f"{self.mass:.1f} kg", f"{self.moving_mass:.1f} kg"
        return total if moving == total else f"{total}, {moving} of which move"

    @cached_property
    def hands(self) -> dict[str, str]:
        """Frame of each hand by side, or by frame name if it has no side.

        It has the role `tcp`, or `eef` on a side without gripper; right comes first.
        """
        tcp, eef = self._sided("tcp"), self._sided("eef")
        if tcp:  # other `eef` frames are not further hands
            eef = {s: f for s, f in eef.items() if s in _SIDES and set(tcp) <= _SIDES}
        hands = eef | tcp
        order = sorted(hands, key=lambda side: (side != "right", side))
        return {side: hands[side] for side in order}

    def _sided(self, role: str) -> dict[str, str]:
        found: dict[str, str] = {}
        for frame in self.frames:
            side = frame.name.split("_", 1)[0]
            if frame.role == role:
                found.setdefault(side if side in _SIDES else frame.name, frame.name)
        return found

    @cached_property
    def _links_by_name(self) -> dict[str, Link]:
        return {link.name: link for link in self.links}

    def link(self, name: str) -> Link:
        """Return a link by name; raises UnknownNameError."""
        return look_up("link", name, self._links_by_name)

    def joint(self, name: str) -> Joint:
        """Return a joint by name; raises UnknownNameError."""
        return look_up("joint", name, {joint.name: joint for joint in self.joints})

    def frame(self, name: str) -> Frame:
        """Return a frame by name; raises UnknownNameError."""
        return look_up("frame", name, {frame.name: frame for frame in self.frames})

    def drawn(self, link: Link) -> tuple[Drawn, ...]:
        """Return the skin of a link, or else its visual shapes."""
        return self.skins.get(link.name, link.visual)

    def link_of(self, frame: str) -> str:
        """Return the link of a frame; a link's name is returned unchanged."""
        return next((f.link for f in self.frames if f.name == frame), frame)

    def group(self, name: str) -> tuple[str, ...]:
        """Return the joints of a group; raises UnknownNameError."""
        return look_up("group", name, self.groups)

    def keyframe(self, name: str) -> dict[str, float]:
        """Return the values of all joints in a posture; followers are computed."""
        return self.posture(look_up("keyframe", name, self.keyframes))

    def posture(self, given: Mapping[str, float]) -> dict[str, float]:
        """Return all joints' values, 0 if not given; followers are computed."""
        values = {**dict.fromkeys(self.joint_names, 0.0), **given}
        for joint in self.joints:
            if joint.mimic is not None:
                leader = values[joint.mimic.joint]
                values[joint.name] = joint.mimic.ratio * leader + joint.mimic.offset
        return values

    def to_mjspec(self) -> "mujoco.MjSpec":
        """Build the MuJoCo specification; physics options keep MuJoCo's defaults."""
        from wbc_suite.robot.mjcf_export import build_mjspec

        return build_mjspec(self)

    def to_mjcf(self) -> str:
        """Return the MuJoCo model as MJCF text with all digits."""
        from wbc_suite.robot.mjcf_export import write_mjcf

        return write_mjcf(self)

    def to_pinocchio(self) -> Any:
        """Build the Pinocchio model (`pinocchio.Model`) without geometry.

        Mimic joints are independent, so that velocities are ordered as in MuJoCo.
        """
        from wbc_suite.robot.pinocchio_export import build_pinocchio

        return build_pinocchio(self)

    def to_urdf(
        self, *, mesh_dir: "Path | None" = None, root: UrdfRoot | None = None
    ) -> str:
        """Return the robot as URDF text; `write_urdf` lists what is converted.

        Shapes that URDF lacks become boxes, or STL files in `mesh_dir`, which the text
        names relative to the folder's parent. `root` is the joint between the world and
        the first link, the robot's own by default; `none` leaves it to the reader.
        """
        from wbc_suite.robot.urdf_export import write_urdf

        return write_urdf(self, mesh_dir=mesh_dir, root=root)

    def to_toml(self) -> str:
        """Return the robot as one component file (TOML), without loss."""
        from wbc_suite.robot.toml_export import write_toml

        return write_toml(self)

    def with_root(
        self, kind: Literal["fixed", "planar", "free"], **changes: Any
    ) -> "RobotDescription":
        """Return the robot with another kind, and other fields, of its root."""
        data = {key: getattr(self, key) for key in type(self).model_fields}
        data["root"] = self.root.model_dump() | {"kind": kind} | changes
        return parse_model(type(self), data, source=self.name, error=DescriptionError)
