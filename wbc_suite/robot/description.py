"""`RobotDescription`: one robot, complete, from which every engine's model is built."""

from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, model_validator

from wbc_suite.errors import DescriptionError, UnknownNameError
from wbc_suite.robot.parts import (
    Actuator,
    Camera,
    Connect,
    Contacts,
    Frame,
    Joint,
    Link,
    Mount,
    Name,
    Root,
    Sensor,
    Synergy,
)
from wbc_suite.robot.shapes import Shape, SkinMesh
from wbc_suite.robot.validation import check_description
from wbc_suite.tomlfile import FrozenModel, parse_model

if TYPE_CHECKING:
    import mujoco

__all__ = ["RobotDescription"]

Rgba = tuple[float, float, float, float]


_SIDES = {"right", "left"}


class RobotDescription(FrozenModel):
    """A robot: links in depth-first order, and everything that hangs on them.

    Valid when it exists: names are unique, inertias are physical, references resolve.
    The MuJoCo and the Pinocchio model built from it have the same joint names and one
    velocity index per joint, in the same order.

    Attributes:
        name: Name of the robot.
        title: Name for people.
        source: Where the figures come from, in words.
        license: Licence of the figures.
        deviations: Each deliberate difference from the source, with its reason.
        root: How the first link stands in the world.
        links: Links, parents before children.
        frames: Named poses on links.
        mounts: Places where components can be mounted.
        cameras: Cameras.
        actuators: Motors that differ from the default.
        sensors: Sensors.
        synergies: Commands of grippers, by gripper.
        groups: Joint names by group, such as `right_arm`.
        keyframes: Joint values by name of the posture; absent joints are zero.
        contacts: Pairs of links that never collide.
        connects: Closed loops.
        materials: Colours by name.
        skins: Meshes that are drawn in place of a link's own shapes, see `robot.skins`.
    """

    name: str
    title: str = ""
    source: str = ""
    license: str = ""
    deviations: tuple[str, ...] = ()
    root: Root = Root()
    links: tuple[Link, ...]
    frames: tuple[Frame, ...] = ()
    mounts: tuple[Mount, ...] = ()
    cameras: tuple[Camera, ...] = ()
    actuators: tuple[Actuator, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    synergies: dict[Name, tuple[Synergy, ...]] = {}
    groups: dict[Name, tuple[Name, ...]] = {}
    keyframes: dict[Name, dict[Name, float]] = {}
    contacts: Contacts = Contacts()
    connects: tuple[Connect, ...] = ()
    materials: dict[Name, Rgba] = {}
    skins: dict[Name, tuple[SkinMesh, ...]] = Field(default={}, exclude=True)

    @model_validator(mode="after")
    def _check(self) -> "RobotDescription":
        check_description(self)
        return self

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """All joints below the root, in the order of both engines' models."""
        return tuple(link.joint for link in self.links if link.joint is not None)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of `joints`."""
        return tuple(joint.name for joint in self.joints)

    @property
    def root_joint_names(self) -> tuple[str, ...]:
        """Names of the root's joints: none, three (planar) or one (free)."""
        names: dict[str, tuple[str, ...]] = {
            "fixed": (),
            "planar": ("root_x", "root_y", "root_yaw"),
            "free": ("root",),
        }
        return names[self.root.kind]

    @cached_property
    def dof(self) -> int:
        """Independent joints: those that follow no other; the root is not counted."""
        return sum(joint.mimic is None for joint in self.joints)

    @cached_property
    def mass(self) -> float:
        """Mass of the whole robot in kg."""
        return sum(link.mass for link in self.links)

    @cached_property
    def hands(self) -> dict[str, str]:
        """The frame of each hand, right before left, by side or by its own name.

        It is the frame with role `tcp`, or `eef` on a side without a gripper.
        """
        tcp, eef = self._sided("tcp"), self._sided("eef")
        if tcp:  # what else ends an arm is no second hand
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
        try:
            return self._links_by_name[name]
        except (KeyError, TypeError):
            raise UnknownNameError("link", name, self._links_by_name) from None

    def drawn(self, link: Link) -> tuple[Shape | SkinMesh, ...]:
        """Return what a link is drawn with."""
        return self.skins.get(link.name, link.visual)

    def joint(self, name: str) -> Joint:
        """Return a joint by name; raises UnknownNameError."""
        for joint in self.joints:
            if joint.name == name:
                return joint
        raise UnknownNameError("joint", name, self.joint_names)

    def frame(self, name: str) -> Frame:
        """Return a frame by name; raises UnknownNameError."""
        for frame in self.frames:
            if frame.name == name:
                return frame
        raise UnknownNameError("frame", name, [f.name for f in self.frames])

    def link_of(self, frame: str) -> str:
        """Return the link that a frame, or a link's own name, belongs to."""
        return next((f.link for f in self.frames if f.name == frame), frame)

    def group(self, name: str) -> tuple[str, ...]:
        """Return the joints of a group; raises UnknownNameError."""
        if name not in tuple(self.groups):
            raise UnknownNameError("group", name, self.groups)
        return self.groups[name]

    def keyframe(self, name: str) -> dict[str, float]:
        """Return a posture with every joint filled in; followers are computed."""
        if name not in tuple(self.keyframes):
            raise UnknownNameError("keyframe", name, self.keyframes)
        values = {j: 0.0 for j in self.joint_names} | self.keyframes[name]
        for joint in self.joints:
            if joint.mimic is not None:
                leader = values[joint.mimic.joint]
                values[joint.name] = joint.mimic.ratio * leader + joint.mimic.offset
        return values

    def to_mjspec(self) -> "mujoco.MjSpec":
        """Build the MuJoCo specification; it compiles alone.

        Physics options are left at MuJoCo's defaults: they belong to the scene.
        """
        from wbc_suite.robot.mjcf import build_mjspec

        return build_mjspec(self)

    def to_mjcf(self) -> str:
        """Write the MuJoCo model as MJCF text, with all digits."""
        from wbc_suite.robot.mjcf import write_mjcf

        return write_mjcf(self)

    def to_pinocchio(self) -> Any:
        """Build the Pinocchio model (`pinocchio.Model`) without geometry.

        Followers (mimic joints) are plain joints of the open tree here, so that nv and
        the order of velocities equal MuJoCo's.
        """
        from wbc_suite.robot.pinocchio import build_pinocchio

        return build_pinocchio(self)

    def to_urdf(self) -> str:
        """Write the robot as URDF text; `write_urdf` says what is lost."""
        from wbc_suite.robot.urdf_export import write_urdf

        return write_urdf(self)

    def to_toml(self) -> str:
        """Write the robot as one component file in our own format; nothing is lost."""
        from wbc_suite.robot.toml_export import write_toml

        return write_toml(self)

    def with_root(
        self, kind: Literal["fixed", "planar", "free"], **changes: Any
    ) -> "RobotDescription":
        """Return the same robot on another root."""
        data = self.root.model_dump() | {"kind": kind} | changes
        source = f"{self.name}: root"
        root = parse_model(Root, data, source=source, error=DescriptionError)
        fields = {key: getattr(self, key) for key in type(self).model_fields}
        return parse_model(
            type(self), fields | {"root": root}, source=source, error=DescriptionError
        )
