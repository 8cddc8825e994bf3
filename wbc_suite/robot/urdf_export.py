"""Write a robot description as URDF text.

URDF has no armature, acceleration limits, actuators, sensors, cameras, keyframes,
groups or closed loops, so these are omitted. `write_urdf` lists what is converted.
"""

from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import pinocchio as pin

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Joint, Link
from wbc_suite.robot.mesh_files import write_stl
from wbc_suite.robot.poses import HasPose, pose_fields, se3_of
from wbc_suite.robot.shape_geometry import along_z, mesh_of, shape_bounds
from wbc_suite.robot.shapes import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Posed,
    Shape,
    Sphere,
)
from wbc_suite.robot.triangle_meshes import ellipsoid_mesh

UNLIMITED = 1e6
"""Written for limits that URDF requires and the robot lacks; read as no limit."""
ROOT_TYPES = {"fixed": "fixed", "free": "floating", "planar": "planar"}
"""Type of the URDF joint `root` by kind of root."""


def write_urdf(robot: RobotDescription, *, mesh_dir: Path | None = None) -> str:
    """Write a robot as URDF text with all digits; equal robots give equal text.

    - A joint `root` of type `fixed`, `floating` or `planar` connects the first link to
      a link `world`. The pose of a free root is omitted, since its coordinates are
      poses in the world, as in `to_pinocchio`.
    - A hinge without range is `continuous`; a slide without range, and a joint without
      velocity limit, get the limit `UNLIMITED`; a joint without motor has effort 0.
    - Frames become massless links on fixed joints.
    - A capsule becomes a cylinder and two spheres. Ellipsoids, hulls, lofts, cones and
      rounded boxes become their bounding boxes, or STL files in `mesh_dir`, which the
      text refers to relative to the folder's parent.
    """
    root = Element("robot", name=robot.name)
    # For MuJoCo, which would infer masses that are absent and drop visual shapes.
    extension = SubElement(root, "mujoco")
    compiler = SubElement(extension, "compiler", inertiafromgeom="false")
    if mesh_dir is not None:
        compiler.attrib |= {"strippath": "false", "discardvisual": "false"}
    for name, rgba in robot.materials.items():
        material = SubElement(root, "material", name=name)
        SubElement(material, "color", rgba=_numbers(rgba))
    SubElement(root, "link", name="world")
    for link in robot.links:
        root.append(_link(robot, link, mesh_dir))
        root.append(_joint(robot, link))
    for frame in robot.frames:
        SubElement(root, "link", name=frame.name)
        name = f"{frame.name}_fixed"
        root.append(_connection(name, "fixed", frame.link, frame.name, frame))
    indent(root)
    return '<?xml version="1.0"?>\n' + tostring(root, "unicode") + "\n"


def _numbers(values: object) -> str:
    """Write numbers with all digits, so that reading them gives equal values."""
    array = np.asarray(values, dtype=np.float64) + 0.0
    return " ".join(map(repr, array.ravel().tolist()))


def _origin(pose: pin.SE3) -> Element:
    rpy = pin.rpy.matrixToRpy(pose.rotation)
    return Element("origin", xyz=_numbers(pose.translation), rpy=_numbers(rpy))


def _connection(
    name: str, kind: str, parent: str, child: str, placed: HasPose
) -> Element:
    joint = Element("joint", name=name, type=kind)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    joint.append(_origin(se3_of(placed)))
    return joint


def _joint(robot: RobotDescription, link: Link) -> Element:
    if link.parent is None:
        kind = ROOT_TYPES[robot.root.kind]
        pose = Posed() if kind == "floating" else robot.root
        element = _connection("root", kind, "world", link.name, pose)
        if kind == "planar":
            SubElement(element, "axis", xyz="0 0 1")
        return element
    if link.joint is None:
        name = f"{link.name}_fixed"
        return _connection(name, "fixed", link.parent, link.name, link)
    joint = link.joint
    kinds = {"hinge": "revolute" if joint.range else "continuous", "slide": "prismatic"}
    element = _connection(joint.name, kinds[joint.type], link.parent, link.name, link)
    SubElement(element, "axis", xyz=_numbers(joint.axis))
    element.append(_limit(joint))
    if joint.damping or joint.frictionloss:
        damping, friction = _numbers(joint.damping), _numbers(joint.frictionloss)
        SubElement(element, "dynamics", damping=damping, friction=friction)
    if joint.mimic is not None:
        ratio, offset = _numbers(joint.mimic.ratio), _numbers(joint.mimic.offset)
        leader = joint.mimic.joint
        SubElement(element, "mimic", joint=leader, multiplier=ratio, offset=offset)
    return element


def _limit(joint: Joint) -> Element:
    limit = Element("limit")
    if joint.range is not None or joint.type == "slide":
        low, high = joint.range or (-UNLIMITED, UNLIMITED)
        limit.set("lower", _numbers(low))
        limit.set("upper", _numbers(high))
    limit.set("effort", _numbers(joint.effort or 0.0))
    limit.set("velocity", _numbers(joint.velocity or UNLIMITED))
    return limit


def _link(robot: RobotDescription, link: Link, mesh_dir: Path | None) -> Element:
    element = Element("link", name=link.name)
    if link.mass > 0.0 or any(link.inertia):
        inertial = SubElement(element, "inertial")
        inertial.append(_origin(pin.SE3(np.eye(3), np.asarray(link.com))))
        SubElement(inertial, "mass", value=_numbers(link.mass))
        keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        moments: dict[str, str] = dict(
            zip(keys, map(_numbers, link.inertia), strict=True)
        )
        SubElement(inertial, "inertia", moments)
    for kind, shapes in (("visual", link.visual), ("collision", link.collision)):
        for index, shape in enumerate(shapes):
            stem = f"{link.name}_{kind}{index}"
            for pose, geometry in _primitives(shape, stem, mesh_dir):
                item = SubElement(element, kind)
                item.append(_origin(pose))
                SubElement(item, "geometry").append(geometry)
                if kind == "visual":
                    item.append(_material(robot, shape))
    return element


def _material(robot: RobotDescription, shape: Shape) -> Element:
    if isinstance(shape.color, str) and shape.color in robot.materials:
        return Element("material", name=shape.color)
    color = (0.5, 0.5, 0.52) if isinstance(shape.color, str) else shape.color
    rgba = (*color, 1.0)[:4]
    name = "rgba_" + "_".join(f"{round(255 * c):03d}" for c in rgba)
    material = Element("material", name=name)
    SubElement(material, "color", rgba=_numbers(rgba))
    return material


def _primitives(
    shape: Shape, stem: str, mesh_dir: Path | None
) -> Iterator[tuple[pin.SE3, Element]]:
    """Yield the poses and geometries that represent one shape."""
    own = se3_of(shape)
    mesh = None if mesh_dir is None else mesh_of(shape)
    if isinstance(shape, Ellipsoid):
        round_mesh = ellipsoid_mesh(np.asarray(shape.size))
        mesh = round_mesh.vertices, round_mesh.faces
    if mesh_dir is not None and mesh is not None:
        write_stl(mesh_dir / f"{stem}.stl", *mesh)
        yield own, Element("mesh", filename=f"{mesh_dir.name}/{stem}.stl")
        return
    match shape:
        case Box(size=size):
            yield own, Element("box", size=_numbers(2 * np.asarray(size)))
        case Sphere(radius=radius):
            yield own, Element("sphere", radius=_numbers(radius))
        case Cylinder(radius_to=None) | Capsule():
            pose, half = along_z(shape)
            radius, length = _numbers(shape.radius), _numbers(2 * half)
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
    return se3_of(shape) * centre, Element("box", size=_numbers(high - low))
