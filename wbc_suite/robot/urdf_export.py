"""Write a robot description as URDF text.

URDF has no armature, acceleration limits, actuators, sensors, cameras, keyframes,
groups or closed loops, so these are omitted. `write_urdf` lists what is converted;
`reader_exports` adds what single readers take.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import pinocchio as pin

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Joint, Link, UrdfRoot
from wbc_suite.robot.inertia import inertia_fields, inertia_of
from wbc_suite.robot.mesh_files import write_mesh
from wbc_suite.robot.moving_inertias import moving_inertias
from wbc_suite.robot.poses import HasPose, pose_fields, se3_of
from wbc_suite.robot.shape_geometry import along_z, mesh_of, shape_bounds
from wbc_suite.robot.shapes import (
    Box,
    Capsule,
    Cylinder,
    Drawn,
    Ellipsoid,
    Posed,
    Shape,
    SkinMesh,
    Sphere,
)
from wbc_suite.robot.triangle_meshes import ellipsoid_mesh, volume
from wbc_suite.typing import Indices, Matrix

UNLIMITED = 1e6
"""Written for limits that URDF requires and the robot lacks; read as no limit."""
ROOT_TYPES = {"fixed": "fixed", "free": "floating", "planar": "planar"}
"""Type of the URDF joint `root` by kind of root."""
GYRATION = 1e-2
"""Radius of gyration of the mass `Dialect.light`, m."""
FLAT = 1e-12
"""m^3; a mesh of less volume, that of a cube of 0.1 mm, counts as flat."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Dialect:
    """What a reader of URDF takes.

    Attributes:
        planar: Whether it reads joints of type `planar`. Otherwise a planar root is two
            slides and a hinge, with the names of those in the engines' models.
        capsule: Tag of a capsule; without one it is a cylinder and two spheres.
        frames: Whether frames are links on fixed joints; they are omitted otherwise.
        flat: Whether it reads meshes without volume, such as labels; MuJoCo refuses.
        light: Mass in kg of links without mass, for readers that assume another one;
            a moving link without mass takes that of the links fixed to it.
        mesh: Format of mesh files.
        mesh_prefix: Text before the path of a mesh file.
    """

    planar: bool = True
    capsule: str | None = None
    frames: bool = True
    flat: bool = True
    light: float | None = None
    mesh: Literal["stl", "obj"] = "stl"
    mesh_prefix: str = ""


PLAIN = Dialect(flat=False)


def write_urdf(
    robot: RobotDescription,
    *,
    mesh_dir: Path | None = None,
    root: UrdfRoot | None = None,
) -> str:
    """Write a robot as URDF text with all digits; equal robots give equal text.

    - A joint `root` of type `fixed`, `floating` or `planar` connects the first link to
      a link `world`; `root` chooses another type than the robot's, or `none`. The pose
      of a free root is omitted, since its coordinates are poses in the world, as in
      `to_pinocchio`. The joint comes last: yourdfpy counts each joint as one coordinate
      to find the leaders of mimic joints.
    - A hinge without range is `continuous`; a slide without range, and a joint without
      velocity limit, get the limit `UNLIMITED`; a joint without motor has effort 0.
    - Frames become massless links on fixed joints.
    - A capsule becomes a cylinder and two spheres. Ellipsoids, hulls, lofts, cones and
      rounded boxes become their bounding boxes, or STL files in `mesh_dir`, which the
      text refers to relative to the folder's parent. A skin is written there, too, but
      for flat pieces, which MuJoCo refuses.
    """
    return urdf_text(urdf_tree(robot, mesh_dir=mesh_dir, root=root))


def urdf_text(root: Element) -> str:
    """Return the text of an XML tree, indented."""
    indent(root)
    return '<?xml version="1.0"?>\n' + tostring(root, "unicode") + "\n"


def urdf_tree(
    robot: RobotDescription,
    dialect: Dialect = PLAIN,
    *,
    mesh_dir: Path | None = None,
    root: UrdfRoot | None = None,
) -> Element:
    """Build the XML tree of `write_urdf` in the dialect of a reader."""
    if root not in (None, "none", ROOT_TYPES[robot.root.kind]):
        robot = robot.with_root("free" if root == "floating" else root)
    tree = Element("robot", name=robot.name)
    # For MuJoCo, which would infer absent masses, drop visual shapes and lose frames.
    extension = SubElement(tree, "mujoco")
    fields = {"inertiafromgeom": "false", "fusestatic": "false"}
    compiler = SubElement(extension, "compiler", fields)
    if mesh_dir is not None:
        compiler.attrib |= {"strippath": "false", "discardvisual": "false"}
    for name, rgba in robot.materials.items():
        material = SubElement(tree, "material", name=name)
        SubElement(material, "color", rgba=numbers_text(rgba))
    root_elements = [] if root == "none" else list(_root(robot, dialect))
    tree.extend(element for element in root_elements if element.tag == "link")
    for link in (
        _with_moving_inertias(robot) if dialect.light is not None else robot.links
    ):
        tree.append(_link(robot, link, dialect, mesh_dir))
        if link.parent is not None:
            tree.append(_joint(link, link.parent))
    for frame in robot.frames if dialect.frames else ():
        tree.append(_bare_link(frame.name, dialect))
        name = f"{frame.name}_fixed"
        tree.append(connection(name, "fixed", frame.link, frame.name, frame))
    tree.extend(element for element in root_elements if element.tag == "joint")
    return tree


def _with_moving_inertias(robot: RobotDescription) -> Iterator[Link]:
    """Yield the links with the inertias that MuJoCo's model has."""
    inertias = moving_inertias(robot)
    for link in robot.links:
        own = inertias[link.name]
        given = {"mass": own.mass, "com": tuple(own.lever.tolist())}
        tensor = {"inertia": inertia_fields(own.inertia)}
        same = own == inertia_of(link)
        yield link if same else link.model_copy(update=given | tensor)


def _root(robot: RobotDescription, dialect: Dialect) -> Iterator[Element]:
    """Yield the links and joints between the world and the first link."""
    yield _bare_link("world", dialect)
    kind, first = ROOT_TYPES[robot.root.kind], robot.links[0].name
    if kind == "planar" and not dialect.planar:
        parent, pose = "world", robot.root
        joints = robot.root.joints
        for joint in joints:
            child = first if joint == joints[-1] else f"{joint.name}_link"
            if child != first:
                yield _bare_link(child, dialect)
            link = Link(name=child, joint=joint, pos=pose.pos, quat=pose.quat)
            yield _joint(link, parent)
            parent, pose = child, Posed()
        return
    pose = Posed() if kind == "floating" else robot.root
    element = connection("root", kind, "world", first, pose)
    if kind == "planar":
        SubElement(element, "axis", xyz="0 0 1")
    yield element


def numbers_text(values: object) -> str:
    """Write numbers with all digits, so that reading them gives equal values."""
    array = np.asarray(values, dtype=np.float64) + 0.0
    return " ".join(map(repr, array.ravel().tolist()))


def origin(pose: pin.SE3) -> Element:
    """Return the element `<origin>` of a pose."""
    rpy = pin.rpy.matrixToRpy(pose.rotation)
    return Element("origin", xyz=numbers_text(pose.translation), rpy=numbers_text(rpy))


def connection(
    name: str, kind: str, parent: str, child: str, placed: HasPose
) -> Element:
    """Return a joint without axis and limits, or an element with the same parts."""
    joint = Element("joint", name=name, type=kind)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    joint.append(origin(se3_of(placed)))
    return joint


def _joint(link: Link, parent: str) -> Element:
    joint = link.joint
    if joint is None:
        return connection(f"{link.name}_fixed", "fixed", parent, link.name, link)
    kinds = {"hinge": "revolute" if joint.range else "continuous", "slide": "prismatic"}
    element = connection(joint.name, kinds[joint.type], parent, link.name, link)
    SubElement(element, "axis", xyz=numbers_text(joint.axis))
    element.append(_limit(joint))
    if joint.damping or joint.frictionloss:
        damping, friction = map(numbers_text, (joint.damping, joint.frictionloss))
        SubElement(element, "dynamics", damping=damping, friction=friction)
    if joint.mimic is not None:
        ratio, offset = map(numbers_text, (joint.mimic.ratio, joint.mimic.offset))
        leader = joint.mimic.joint
        SubElement(element, "mimic", joint=leader, multiplier=ratio, offset=offset)
    return element


def _limit(joint: Joint) -> Element:
    limit = Element("limit")
    if joint.range is not None or joint.type == "slide":
        low, high = joint.range or (-UNLIMITED, UNLIMITED)
        limit.set("lower", numbers_text(low))
        limit.set("upper", numbers_text(high))
    limit.set("effort", numbers_text(joint.effort or 0.0))
    limit.set("velocity", numbers_text(joint.velocity or UNLIMITED))
    return limit


def _bare_link(name: str, dialect: Dialect) -> Element:
    """Return a link without shapes and mass."""
    element = Element("link", name=name)
    if dialect.light is not None:
        element.append(_inertial(_light(Link(name=name), dialect.light)))
    return element


def _light(link: Link, mass: float) -> Link:
    moment = mass * GYRATION**2
    fields = {"mass": mass, "inertia": (moment, moment, moment, 0.0, 0.0, 0.0)}
    return link.model_copy(update=fields)


def _inertial(link: Link) -> Element:
    element = Element("inertial")
    element.append(origin(pin.SE3(np.eye(3), np.asarray(link.com))))
    SubElement(element, "mass", value=numbers_text(link.mass))
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    moments: dict[str, str] = dict(
        zip(keys, map(numbers_text, link.inertia), strict=True)
    )
    SubElement(element, "inertia", moments)
    return element


def _link(
    robot: RobotDescription, link: Link, dialect: Dialect, mesh_dir: Path | None
) -> Element:
    element = Element("link", name=link.name)
    if link.mass > 0.0 or any(link.inertia):
        element.append(_inertial(link))
    elif dialect.light is not None:
        element.append(_inertial(_light(link, dialect.light)))
    drawn = link.visual if mesh_dir is None else robot.drawn(link)
    for kind, shapes in (("visual", drawn), ("collision", link.collision)):
        for index, shape in enumerate(shapes):
            stem = f"{link.name}_{kind}{index}"
            for pose, geometry in _geometries(shape, stem, dialect, mesh_dir):
                item = SubElement(element, kind)
                item.append(origin(pose))
                SubElement(item, "geometry").append(geometry)
                if kind == "visual":
                    item.append(_material(robot, shape))
    return element


def _material(robot: RobotDescription, shape: Drawn) -> Element:
    if isinstance(shape.color, str) and shape.color in robot.materials:
        return Element("material", name=shape.color)
    color = (0.5, 0.5, 0.52) if isinstance(shape.color, str) else shape.color
    rgba = (*color, 1.0)[:4]
    name = "rgba_" + "_".join(f"{round(255 * c):03d}" for c in rgba)
    material = Element("material", name=name)
    SubElement(material, "color", rgba=numbers_text(rgba))
    return material


def _geometries(
    shape: Drawn, stem: str, dialect: Dialect, mesh_dir: Path | None
) -> Iterator[tuple[pin.SE3, Element]]:
    """Yield the poses and geometries that represent one shape."""
    own = se3_of(shape)
    if mesh_dir is not None and (mesh := _surface(shape)) is not None:
        if dialect.flat or volume(*mesh) >= FLAT:
            file = f"{stem}.{dialect.mesh}"
            write_mesh(mesh_dir / file, *mesh, kind=dialect.mesh)
            name = f"{dialect.mesh_prefix}{mesh_dir.name}/{file}"
            yield own, Element("mesh", filename=name)
    elif not isinstance(shape, SkinMesh):
        yield from _primitives(shape, dialect)


def _surface(shape: Drawn) -> tuple[Matrix, Indices] | None:
    """Return the vertices and faces of a shape that URDF lacks; None for others."""
    if isinstance(shape, Ellipsoid):
        mesh = ellipsoid_mesh(np.asarray(shape.size))
        return mesh.vertices, mesh.faces
    return mesh_of(shape)


def _primitives(shape: Shape, dialect: Dialect) -> Iterator[tuple[pin.SE3, Element]]:
    """Yield the poses and geometries of a shape, its bounding box if URDF lacks it."""
    own = se3_of(shape)
    match shape:
        case Box(size=size):
            yield own, Element("box", size=numbers_text(2 * np.asarray(size)))
        case Sphere(radius=radius):
            yield own, Element("sphere", radius=numbers_text(radius))
        case Cylinder(radius_to=None) | Capsule():
            pose, half = along_z(shape)
            radius, length = numbers_text(shape.radius), numbers_text(2 * half)
            if dialect.capsule and isinstance(shape, Capsule):
                sizes = {"radius": radius, "length": length}
                yield se3_of(pose), Element(dialect.capsule, sizes)
                return
            yield se3_of(pose), Element("cylinder", radius=radius, length=length)
            if isinstance(shape, Capsule):
                for end in (shape.start, shape.end):
                    ball = Element("sphere", radius=radius)
                    yield own * pin.SE3(np.eye(3), np.asarray(end)), ball
        case _:
            yield _bounding_box(shape)


def _bounding_box(shape: Shape) -> tuple[pin.SE3, Element]:
    """Return the bounding box along the axes of the shape's own frame."""
    level = shape.model_copy(update=pose_fields(pin.SE3.Identity()))
    low, high = shape_bounds(level)
    centre = pin.SE3(np.eye(3), (low + high) / 2)
    return se3_of(shape) * centre, Element("box", size=numbers_text(high - low))
