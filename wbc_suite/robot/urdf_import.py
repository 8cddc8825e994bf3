"""Read a URDF file into a robot description."""

import logging
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from wbc_suite.errors import DescriptionError
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.importing import (
    LinkFields,
    describe_import,
    inertia_fields,
    shortened,
)
from wbc_suite.robot.naming import NameTable
from wbc_suite.robot.overlaps import overlapping_neighbours
from wbc_suite.robot.parts import Contacts
from wbc_suite.robot.placing import pose_fields
from wbc_suite.robot.urdf_export import UNLIMITED
from wbc_suite.robot.urdf_shapes import MeshFolder, UrdfShapes
from wbc_suite.robot.urdf_tree import Branch, UrdfTree, read_tree
from wbc_suite.robot.urdf_values import number, numbers, pose_of

__all__ = ["read_urdf"]

LOG = logging.getLogger(__name__)
Element = ElementTree.Element

ENDLESS = 1e4
"""A range as wide, in rad or m, means that there is none."""
MOVING = {
    "revolute": "hinge",
    "continuous": "hinge",
    "prismatic": "slide",
}
ROOTS = {"fixed": "fixed", "floating": "free", "planar": "planar"}


def read_urdf(
    path: Path | str, *, mesh_root: Path | None = None, mend_inertias: bool = False
) -> RobotDescription:
    """Read a URDF file.

    Links and joints keep their names where our format allows them (letters, digits,
    `_`, unique over links, joints and frames). A massless link `world` above the robot
    tells how it is rooted. Massless links without shapes at the ends become frames.
    Meshes become convex hulls. Groups, end effectors and the posture `ready` are
    guessed; `to_toml()` writes the result in our own format for editing.

    Args:
        path: The file.
        mesh_root: Folder that meshes may be read from, and that `package://` names
            start in; by default the ROS package that the file is in, or its own folder.

        mend_inertias: Take the nearest tensor that a body can have in place of one that
            no body has, with a warning, instead of raising.

    Raises:
        ConfigError: If the file is no URDF, or leads out of the folder.
        DescriptionError: If the robot contradicts itself or physics.
    """
    path = Path(path)
    tree = read_tree(path)
    meshes = MeshFolder(path, mesh_root)
    try:
        importer = _Importer(tree, UrdfShapes(tree.robot, meshes))
        robot = importer.robot(path, mend_inertias=mend_inertias)
    except DescriptionError as error:
        if str(error).startswith(str(path)):
            raise
        raise DescriptionError(f"{path}: {error}") from error
    meshes.report()
    return _apart(robot, path)


def _apart(robot: RobotDescription, path: Path) -> RobotDescription:
    """Let links not collide that stand in each other, and say so."""
    pairs = overlapping_neighbours(robot)
    if not pairs:
        return robot
    told = ", ".join(f"'{first}' and '{second}'" for first, second in pairs)
    LOG.warning(
        "%s: stand in each other in the posture ready, so they do not collide: %s.",
        path,
        shortened(told),
    )
    return robot.model_copy(update={"contacts": Contacts(exclude=pairs)})


class _Importer:
    """Carries the names and shapes of one file into the fields of a description."""

    def __init__(self, tree: UrdfTree, shapes: UrdfShapes) -> None:
        self._tree = tree
        self._shapes = shapes
        self._names = NameTable()
        self._links: dict[str, str] = {}
        self._joints: dict[str, str] = {}

    def robot(self, path: Path, *, mend_inertias: bool) -> RobotDescription:
        root, branches = self._rooted()
        frames = _frame_names(branches)
        kept = [branch for branch in branches if branch.name not in frames]
        for branch in kept:
            self._links[branch.name] = self._names.take(branch.name, "link")
        for branch in kept:
            if branch.joint is not None and branch.kind in MOVING:
                foreign = branch.joint.get("name", "")
                self._joints[foreign] = self._names.take(foreign, "joint")
        first = kept[0]
        return describe_import(
            name=self._tree.robot.get("name", "") or path.stem,
            source=path,
            root=root,
            links=[self._link(branch, first=branch is first) for branch in kept],
            frames=self._frames(branches, frames),
            materials=self._shapes.palette.colors,
            names=self._names,
            mend_inertias=mend_inertias,
        )

    def _rooted(self) -> tuple[dict[str, Any], tuple[Branch, ...]]:
        """Return the fields of the root, and the branches without the world."""
        world, *rest = self._tree.branches
        below = self._tree.below(world.name)
        wild = [b for b in self._tree.branches if b.kind in ("floating", "planar")]
        leads = len(below) == 1 and below[0].kind in ROOTS and _is_bare(world)
        if leads and (world.name == "world" or wild):
            kind = ROOTS[below[0].kind]
            joint = _joint_of(below[0])
            if kind == "planar":
                _check_planar(joint)
            pose = pose_of(joint, where=f"joint '{joint.get('name')}'")
            wild = [b for b in wild if b is not below[0]]
            _refuse_wild(wild)
            return {"kind": kind, **pose_fields(pose)}, tuple(rest)
        _refuse_wild(wild)
        return {"kind": "fixed"}, self._tree.branches

    def _link(self, branch: Branch, *, first: bool) -> LinkFields:
        where = f"link '{branch.name}'"
        fields: LinkFields = {"name": self._links[branch.name]}
        fields |= _inertial(branch.link, where)
        fields |= self._shapes.of(branch.link)
        if first or branch.joint is None:
            return fields
        joint_where = f"joint '{branch.joint.get('name')}'"
        pose = pose_of(branch.joint, where=joint_where)
        fields |= {"parent": self._links[str(branch.parent)], **pose_fields(pose)}
        if branch.kind in MOVING:
            fields["joint"] = self._joint(branch.joint, branch.kind, joint_where)
        elif branch.kind != "fixed":
            raise DescriptionError(f"{joint_where}: unknown type '{branch.kind}'.")
        return fields

    def _joint(self, joint: Element, kind: str, where: str) -> dict[str, Any]:
        fields: dict[str, Any] = {
            "name": self._joints[joint.get("name", "")],
            "type": MOVING[kind],
            "axis": _axis(joint, where),
            **_limits(joint, kind, where),
        }
        dynamics = joint.find("dynamics")
        if dynamics is not None:
            fields["damping"] = number(dynamics, "damping", where=where, default=0.0)
            fields["frictionloss"] = number(
                dynamics, "friction", where=where, default=0.0
            )
        mimic = joint.find("mimic")
        if mimic is not None:
            fields["mimic"] = self._mimic(mimic, where)
        return fields

    def _mimic(self, mimic: Element, where: str) -> dict[str, Any]:
        leader = mimic.get("joint", "")
        return {
            "joint": self._joints.get(leader, leader or "nothing"),
            "ratio": number(mimic, "multiplier", where=where, default=1.0),
            "offset": number(mimic, "offset", where=where, default=0.0),
        }

    def _frames(
        self, branches: tuple[Branch, ...], frames: set[str]
    ) -> list[dict[str, Any]]:
        """Turn bare links into frames of the link that they are fixed to."""
        poses = {name: (ours, pin.SE3.Identity()) for name, ours in self._links.items()}
        found: list[dict[str, Any]] = []
        for branch in branches:
            if branch.name in frames and branch.joint is not None:
                link, above = poses[str(branch.parent)]
                where = f"joint '{branch.joint.get('name')}'"
                pose = above * pose_of(branch.joint, where=where)
                poses[branch.name] = (link, pose)
                name = self._names.take(branch.name, "frame")
                found.append({"name": name, "link": link, **pose_fields(pose)})
        return found


def _is_bare(branch: Branch) -> bool:
    tags = ("inertial", "visual", "collision")
    return all(branch.link.find(tag) is None for tag in tags)


def _joint_of(branch: Branch) -> Element:
    assert branch.joint is not None
    return branch.joint


def _refuse_wild(branches: list[Branch]) -> None:
    for branch in branches:
        raise DescriptionError(
            f"joint '{_joint_of(branch).get('name')}' is {branch.kind}: only the joint "
            "between a bare link 'world' and the rest of the robot may be."
        )


def _check_planar(joint: Element) -> None:
    axis = _axis(joint, f"joint '{joint.get('name')}'")
    if not np.allclose(axis, (0.0, 0.0, 1.0)):
        raise DescriptionError(
            f"joint '{joint.get('name')}': a planar root moves in the plane across "
            f"z; its axis is {axis}."
        )


def _frame_names(branches: tuple[Branch, ...]) -> set[str]:
    """Return the bare fixed links that carry nothing but their like."""
    frames: set[str] = set()
    for branch in reversed(branches):
        below = [b.name for b in branches if b.parent == branch.name]
        leaf = branch is not branches[0] and all(name in frames for name in below)
        if leaf and branch.kind == "fixed" and _is_bare(branch):
            frames.add(branch.name)
    return frames


def _axis(joint: Element, where: str) -> list[float]:
    element = joint.find("axis")
    if element is None:
        return [1.0, 0.0, 0.0]  # URDF's own default
    axis = numbers(element, "xyz", 3, where=where, default=(1.0, 0.0, 0.0))
    length = float(np.linalg.norm(axis))
    if length < 1e-6:
        raise DescriptionError(f"{where}: the axis {axis.tolist()} has no direction.")
    return (axis / length).tolist()


def _limits(joint: Element, kind: str, where: str) -> dict[str, Any]:
    """Read `<limit>`; zero efforts and speeds, and huge limits, mean there is none."""
    limit = joint.find("limit")
    if limit is None:
        if kind == "continuous":
            return {}
        raise DescriptionError(
            f"{where}: a {kind} joint needs <limit>; one that turns without end is "
            "'continuous'."
        )
    fields: dict[str, Any] = {}
    for ours in ("effort", "velocity"):
        value = number(limit, ours, where=where, default=0.0)
        if 0.0 != value < UNLIMITED:
            fields[ours] = value
    low = number(limit, "lower", where=where, default=0.0)
    high = number(limit, "upper", where=where, default=0.0)
    if kind != "continuous" and max(-low, high) < ENDLESS:
        if not low < high:
            raise DescriptionError(
                f"{where}: it cannot move from {low} to {high}. Mend 'lower' and "
                "'upper', or make it fixed, or continuous if it turns without end."
            )
        fields["range"] = (low, high)
    return fields


def _inertial(link: Element, where: str) -> dict[str, Any]:
    """Read `<inertial>`, and turn its tensor into the link's axes."""
    element = link.find("inertial")
    if element is None:
        return {}
    pose = pose_of(element, where=where)
    mass, tensor = element.find("mass"), element.find("inertia")
    if mass is None or tensor is None:
        raise DescriptionError(f"{where}: <inertial> needs <mass> and <inertia>.")
    xx, yy, zz, xy, xz, yz = (
        number(tensor, key, where=where, default=0.0)
        for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    R = pose.rotation
    turned = own if np.array_equal(R, np.eye(3)) else R @ own @ R.T
    kilograms = number(mass, "value", where=where)
    if kilograms == 0.0:
        if own.any():
            LOG.warning("%s has no mass; its inertia tensor is left out.", where)
        return {}
    return {
        "mass": kilograms,
        "com": pose.translation.tolist(),
        "inertia": inertia_fields(turned),
    }
