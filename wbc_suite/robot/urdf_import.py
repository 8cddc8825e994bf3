"""Read a URDF file into a robot description."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite import logs
from wbc_suite.errors import DescriptionError, did_you_mean, join_first
from wbc_suite.robot.adopt.contact_pairs import exclude_contacts
from wbc_suite.robot.adopt.importing import (
    UNLIMITED_RANGE,
    LinkFields,
    NameTable,
    describe_import,
)
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.inertia import inertia_fields, inertia_matrix
from wbc_suite.robot.poses import pose_fields
from wbc_suite.robot.shapes import Drawn
from wbc_suite.robot.urdf_elements import (
    Branch,
    number,
    numbers,
    place_of,
    pose_of,
    read_tree,
)
from wbc_suite.robot.urdf_export import ROOT_TYPES, UNLIMITED
from wbc_suite.robot.urdf_import_shapes import MeshFolder, UrdfShapes
from wbc_suite.robot.xml_files import Element, at_line

LOG = logs.logger(__name__)

ENDLESS = "the file has no range for these joints, which are endless"
REVERSED = "the ranges of these joints are reversed; mended"
CONTINUOUS = (
    "the ranges of these joints are not used, since the file calls them continuous "
    "(make them revolute to have limits)"
)
FEET = 4
"""A robot with so many feet is free if the file does not attach it to the world."""
JOINT_TYPES = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide"}
ROOT_KINDS = {urdf: kind for kind, urdf in ROOT_TYPES.items()}


def read_urdf(
    path: Path | str,
    *,
    mesh_root: Path | str | None = None,
    strict: bool = False,
    skin: bool = True,
    contacts: bool = True,
) -> RobotDescription:
    """Read a URDF file.

    Links and joints keep names that are valid in our format (letters, digits, `_`,
    unique over links, joints and frames). The joint below a massless link `world`
    defines the root. Massless links without shapes at the ends become frames. Meshes
    are drawn, and collide as convex hulls. Groups, end effectors and the posture
    `ready` are inferred; `to_toml()` writes the result for editing.

    Args:
        path: The file.
        mesh_root: Folder that meshes are read from, and that `package://` refers to.
            By default the ROS package or model folder that encloses the file, and for
            `package://` also packages beside these and those that ROS finds.
        strict: Refuse what is mended with a warning otherwise: inertias that no body
            can have, moving links without mass, faulty shapes.
        skin: Draw links with their meshes, not with the hulls of these.
        contacts: Find the links that must not collide, by simulation.

    Raises:
        ConfigError: If the file is not URDF.
        DescriptionError: If the robot is inconsistent, or faulty and `strict`.
    """
    path = Path(path)
    element, branches = read_tree(path)
    names = (mesh.get("filename", "") for mesh in element.iter("mesh"))
    meshes = MeshFolder(path, mesh_root, names)
    try:
        shapes = UrdfShapes(element, meshes, strict=strict)
        importer = _Importer(branches, shapes, strict=strict)
        name = element.get("name", "") or path.stem
        robot = importer.robot(name, path)
    except DescriptionError as error:
        if str(error).startswith(str(path)):
            raise
        raise DescriptionError(f"{path}: {error}") from error
    shapes.report(path)
    feet = sum(frame.role == "foot" for frame in robot.frames)
    if feet >= FEET and not importer.rooted:
        try:
            robot = robot.with_root("free")
            LOG.warning("%s: its root is free, since it has %d feet.", path, feet)
        except DescriptionError as error:
            LOG.warning("%s: its root is fixed: %s", path, error)
    if skin:
        robot = robot.model_copy(update={"skins": importer.skins()})
    return exclude_contacts(robot, path) if contacts else robot


class _Importer:
    """Converts the elements of one file to the fields of a description.

    `rooted` says whether the file connects the robot to a link `world`.
    """

    def __init__(
        self, branches: tuple[Branch, ...], shapes: UrdfShapes, *, strict: bool
    ) -> None:
        self._branches, self._shapes, self._strict = branches, shapes, strict
        self._names = NameTable()
        self._links: dict[str, str] = {}
        self._joints: dict[str, str] = {}
        self._ranges: dict[str, list[str]] = {}
        self.rooted = False

    def robot(self, name: str, path: Path) -> RobotDescription:
        _hold_stuck(self._branches, path, strict=self._strict)
        root, branches = self._root()
        frames = _frame_names(branches)
        kept = [branch for branch in branches if branch.name not in frames]
        for branch in kept:
            self._links[branch.name] = self._names.take(branch.name, "link")
        for branch in kept:
            if branch.joint is not None and branch.kind in JOINT_TYPES:
                original = branch.joint.get("name", "")
                self._joints[original] = self._names.take(original, "joint")
        links = [self._link(branch, first=branch is kept[0]) for branch in kept]
        for text, joints in self._ranges.items():
            LOG.warning("%s: %s: %s.", path, text, join_first(joints, limit=12))
        elements = {self._links[branch.name]: branch.link for branch in kept}
        return describe_import(
            name=name,
            source=path,
            root=root,
            links=links,
            frames=self._frames(branches, frames),
            materials=self._shapes.colors,
            names=self._names,
            lines={self._links[b.name]: at_line(b.link) for b in kept},
            meshes={self._links[b.name]: _mesh_names(b.link) for b in kept},
            strict=self._strict,
            slabs=lambda name: self._shapes.slabs(elements[name]),
        )

    def skins(self) -> dict[str, tuple[Drawn, ...]]:
        """Return what draws the links with meshes, by their names."""
        return {self._links[name]: s for name, s in self._shapes.skins.items()}

    def _root(self) -> tuple[dict[str, Any], tuple[Branch, ...]]:
        """Return the fields of the root, and the branches without the world."""
        self._hold_loose_parts()
        world, *rest = self._branches
        below = [b for b in rest if b.parent == world.name]
        moving = [b for b in rest if b.kind in ("floating", "planar")]
        first = below[0] if len(below) == 1 else None
        if first is not None and not _is_bare(world):
            if first.kind != "floating":
                first = None
            else:
                LOG.warning("Link '%s' is the world: left out.", world.name)
        if first is None or first.kind not in ROOT_KINDS:
            _refuse_roots(moving)
            return {"kind": "fixed"}, self._branches
        if world.name != "world" and not moving:
            return {"kind": "fixed"}, self._branches
        if first.joint is not None and first.kind == "planar":
            axis = _axis(first.joint, first.where)
            if not np.allclose(axis, (0.0, 0.0, 1.0)):
                raise DescriptionError(
                    f"{first.where}: a planar root needs the axis z, not {axis}."
                )
        _refuse_roots([b for b in moving if b is not first])
        kind, self.rooted = ROOT_KINDS[first.kind], True
        return {"kind": kind, **pose_fields(first.pose)}, tuple(rest)

    def _hold_loose_parts(self) -> None:
        """Fix floating links at the ends of the tree to what carries them."""
        inner = {b.parent for b in self._branches}
        for b in self._branches[1:]:
            loose = b.kind == "floating" and b.name not in inner and not self._strict
            if loose and b.joint is not None and b.parent != self._branches[0].name:
                b.joint.set("type", "fixed")
                LOG.warning("Link '%s' floats beside the robot: held fixed.", b.name)

    def _link(self, branch: Branch, *, first: bool) -> LinkFields:
        fields: LinkFields = {"name": self._links[branch.name]}
        where = place_of(branch.link)
        fields |= _inertial(branch.link, where, strict=self._strict)
        fields |= self._shapes.of(branch.link)
        if first or branch.joint is None:
            return fields
        parent = self._links[str(branch.parent)]
        fields |= {"parent": parent, **pose_fields(branch.pose)}
        if branch.kind in JOINT_TYPES:
            fields["joint"] = self._joint(branch.joint, branch.kind, branch.where)
        elif branch.kind != "fixed":
            raise DescriptionError(f"{branch.where}: unknown type '{branch.kind}'.")
        return fields

    def _joint(self, joint: Element, kind: str, where: str) -> dict[str, Any]:
        fields: dict[str, Any] = {
            "name": self._joints[joint.get("name", "")],
            "type": JOINT_TYPES[kind],
            "axis": _axis(joint, where),
            **_limits(joint, where),
        }
        if limits := self._range(joint, kind, where):
            fields["range"] = limits
        dynamics = joint.find("dynamics")
        if dynamics is not None:
            for ours, key in (("damping", "damping"), ("frictionloss", "friction")):
                fields[ours] = number(dynamics, key, where=where, default=0.0)
        for name, ratio, offset in _mimics(joint, where):
            if leader := self._leader(name, where):
                fields["mimic"] = {"joint": leader, "ratio": ratio, "offset": offset}
        return fields

    def _range(
        self, joint: Element, kind: str, where: str
    ) -> tuple[float, float] | None:
        """Return the range of a joint, and note what is not as it should be.

        One that is missing, empty at zero or huge means an endless joint.
        """
        low, high = _ends(joint, where)
        name = self._joints[joint.get("name", "")]
        if low > high and self._strict:
            raise DescriptionError(
                f"{where}: its range from {low} to {high} is reversed. Swap 'lower' "
                "and 'upper'."
            )
        note = REVERSED if low > high else None
        low, high = min(low, high), max(low, high)
        endless = low == high or max(-low, high) >= UNLIMITED_RANGE
        shown = name if endless else f"{name} from {low:g} to {high:g}"
        if kind == "continuous":
            note = None if endless else CONTINUOUS
        elif endless:
            note = ENDLESS
        if note:
            self._ranges.setdefault(note, []).append(shown)
        return None if endless or kind == "continuous" else (low, high)

    def _leader(self, name: str, where: str) -> str | None:
        """Return the joint that another follows; None if it does not move."""
        if name not in self._joints:
            fault = f"{where} follows '{name}', which is no moving joint"
            if self._strict:
                raise DescriptionError(f"{fault}.{did_you_mean(name, self._joints)}")
            LOG.warning("%s; it is independent.", fault)
        return self._joints.get(name)

    def _frames(
        self, branches: tuple[Branch, ...], frames: set[str]
    ) -> list[dict[str, Any]]:
        """Return massless links as frames of the link that they are fixed to."""
        poses = {name: (ours, pin.SE3.Identity()) for name, ours in self._links.items()}
        found: list[dict[str, Any]] = []
        for branch in branches:
            if branch.name in frames:
                link, above = poses[str(branch.parent)]
                poses[branch.name] = (link, above * branch.pose)
                name = self._names.take(branch.name, "frame")
                pose = pose_fields(poses[branch.name][1])
                found.append({"name": name, "link": link, **pose})
        return found


def _hold_stuck(branches: tuple[Branch, ...], path: Path, *, strict: bool) -> None:
    """Fix joints whose range is one value other than 0 there, and their followers."""
    moving = {
        b.joint.get("name", ""): (b, b.joint)
        for b in branches
        if b.joint is not None and b.kind in JOINT_TYPES
    }
    held: dict[str, float] = {}
    for name, (branch, joint) in moving.items():
        low, high = _ends(joint, branch.where)
        if low == high != 0.0 and branch.kind != "continuous":
            held[name] = low
            if strict:
                raise DescriptionError(
                    f"{branch.where}: it cannot move from {low:g} to {high:g}. Correct "
                    "'lower' and 'upper', or make it fixed, or continuous if it is "
                    "unlimited."
                )
    following = held
    while following:
        following = {
            name: scale * held[leader] + offset
            for name, (branch, joint) in moving.items()
            for leader, scale, offset in _mimics(joint, branch.where)
            if leader in held and name not in held
        }
        held |= following
    for name, value in held.items():
        _fix(*moving[name], value)
    if held:
        shown = [
            f"{moving[name][0].where} at {value:g}" for name, value in held.items()
        ]
        LOG.warning(
            "%s: held fixed, since 'lower' equals 'upper', or as followers of such a "
            "joint; correct the range if it should move: %s.",
            *(path, join_first(shown, limit=12)),
        )


def _fix(branch: Branch, joint: Element, value: float) -> None:
    """Make a joint fixed at a value, rad or m."""
    axis = value * np.asarray(_axis(joint, branch.where))
    turns = JOINT_TYPES[branch.kind] == "hinge"
    motion = pin.SE3(pin.exp3(axis), np.zeros(3)) if turns else pin.SE3(np.eye(3), axis)
    pose = branch.pose * motion
    for origin in joint.findall("origin"):
        joint.remove(origin)
    places = {"xyz": pose.translation, "rpy": pin.rpy.matrixToRpy(pose.rotation)}
    texts = {key: " ".join(map(repr, x.tolist())) for key, x in places.items()}
    joint.append(Element("origin", texts))
    joint.set("type", "fixed")


def _is_bare(branch: Branch) -> bool:
    tags = ("inertial", "visual", "collision")
    return all(branch.link.find(tag) is None for tag in tags)


def _mesh_names(link: Element) -> str:
    return " ".join(mesh.get("filename", "") for mesh in link.iter("mesh"))


def _refuse_roots(branches: list[Branch]) -> None:
    for branch in branches:
        raise DescriptionError(
            f"{branch.where} is {branch.kind}: only the joint between an empty link "
            "'world' and the rest of the robot may be."
        )


def _frame_names(branches: tuple[Branch, ...]) -> set[str]:
    """Return the bare fixed links whose children are all frames."""
    frames: set[str] = set()
    for branch in reversed(branches):
        below = [b.name for b in branches if b.parent == branch.name]
        leaf = branch is not branches[0] and all(name in frames for name in below)
        if leaf and branch.kind == "fixed" and _is_bare(branch):
            frames.add(branch.name)
    return frames


def _ends(joint: Element, where: str) -> tuple[float, float]:
    """Read 'lower' and 'upper', 0 by default as in URDF."""
    limit = joint.find("limit")
    if limit is None:
        return 0.0, 0.0
    low, high = (
        number(limit, key, where=where, default=0.0) for key in ("lower", "upper")
    )
    return low, high


def _mimics(joint: Element, where: str) -> Iterator[tuple[str, float, float]]:
    """Yield name, multiplier and offset of the joint that one follows, if any."""
    mimic = joint.find("mimic")
    if mimic is not None:
        ratio = number(mimic, "multiplier", where=where, default=1.0)
        offset = number(mimic, "offset", where=where, default=0.0)
        yield mimic.get("joint", ""), ratio, offset


def _axis(joint: Element, where: str) -> list[float]:
    element = joint.find("axis")
    if element is None:
        return [1.0, 0.0, 0.0]  # URDF's own default
    axis = numbers(element, "xyz", 3, where=where, default=(1.0, 0.0, 0.0))
    length = float(np.linalg.norm(axis))
    if length < 1e-6:
        raise DescriptionError(f"{where}: the axis {axis.tolist()} has length zero.")
    return (axis / length).tolist()


def _limits(joint: Element, where: str) -> dict[str, Any]:
    """Read effort and velocity of `<limit>`; none if they are <= 0, or huge."""
    limit = joint.find("limit")
    if limit is None:
        return {}
    fields: dict[str, Any] = {}
    for key in ("effort", "velocity"):
        value = number(limit, key, where=where, default=0.0)
        if 0.0 < value < UNLIMITED:
            fields[key] = value
    return fields


def _inertial(link: Element, where: str, *, strict: bool) -> dict[str, Any]:
    """Read `<inertial>`, with the tensor in the link's axes."""
    element = link.find("inertial")
    if element is None:
        return {}
    pose = pose_of(element, where=where)
    mass, tensor = element.find("mass"), element.find("inertia")
    if (mass is None or tensor is None) and strict:
        raise DescriptionError(f"{where}: <inertial> needs <mass> and <inertia>.")
    if mass is None or tensor is None:
        LOG.warning("%s: <inertial> without <mass> or <inertia> counts as 0.", where)
        mass = Element("mass", value="0") if mass is None else mass
        tensor = Element("inertia") if tensor is None else tensor
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    own = inertia_matrix(
        tuple(number(tensor, key, where=where, default=0.0) for key in keys)
    )
    R = pose.rotation
    turned = own if np.array_equal(R, np.eye(3)) else R @ own @ R.T
    kilograms = number(mass, "value", where=where)
    if kilograms == 0.0 and not own.any():
        return {}
    return {
        "mass": kilograms,
        "com": pose.translation.tolist(),
        "inertia": inertia_fields(turned),
    }
