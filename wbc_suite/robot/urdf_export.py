"""Write a robot description as URDF text.

URDF knows trees of links with boxes, cylinders, spheres and meshes. What it has no word
for is left out (armature, acceleration limits, actuators, sensors, cameras, keyframes,
groups, closed loops) or put into words that it has; `write_urdf` says which.
"""

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.mesh_files import write_stl
from wbc_suite.robot.parts import Joint, Link
from wbc_suite.robot.placing import pose_fields, se3_of
from wbc_suite.robot.shapes import Box, Capsule, Cylinder, Posed, Shape, Sphere
from wbc_suite.robot.surfaces import mesh_of
from wbc_suite.robot.validation import shape_bounds
from wbc_suite.typing import Matrix

__all__ = ["UNLIMITED", "write_urdf"]

UNLIMITED = 1e6
"""Written where URDF asks for a limit and the robot has none; read back as none."""

Element = ElementTree.Element


def write_urdf(robot: RobotDescription, *, mesh_dir: Path | None = None) -> str:
    """Write a robot as URDF text with all digits; equal robots give equal text.

    - The first link hangs on a link `world` by a joint `root`: `fixed`, `floating` or
      `planar` as the robot's root is. Where a free root stands is no part of it: its
      coordinates are poses in the world, as in `to_pinocchio`.
    - A joint without range is `continuous`; a slide without range, and a joint without
      speed limit, get the limit `UNLIMITED`; a joint without motor has effort 0.
    - Frames are massless links on fixed joints.
    - A capsule is a cylinder and two spheres. Ellipsoids, hulls, lofts, cones and
      rounded boxes are their enclosing boxes, or meshes if `mesh_dir` is given.

    Args:
        robot: The robot.
        mesh_dir: Folder for STL files of the shapes that URDF has no word for; the
            text names them relative to the folder's parent, where it should be saved.
    """
    root = Element("robot", name=robot.name)
    # Other readers skip this; MuJoCo would invent a mass for links without one.
    extension = ElementTree.SubElement(root, "mujoco")
    ElementTree.SubElement(extension, "compiler", inertiafromgeom="false")
    for name, rgba in robot.materials.items():
        material = ElementTree.SubElement(root, "material", name=name)
        ElementTree.SubElement(material, "color", rgba=_numbers(rgba))
    ElementTree.SubElement(root, "link", name="world")
    for link in robot.links:
        root.append(_link(robot, link, mesh_dir))
        root.append(_joint(robot, link))
    for frame in robot.frames:
        ElementTree.SubElement(root, "link", name=frame.name)
        root.append(_fixed(f"{frame.name}_fixed", frame.link, frame.name, frame))
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, "unicode") + "\n"


def rpy_of(rotation: Matrix) -> tuple[float, float, float]:
    """Compute fixed-axis roll, pitch, yaw of a rotation, shape (3, 3).

    R = Rz(yaw) Ry(pitch) Rx(roll). Roll and pitch are read from Rz(-yaw) R and not from
    R, so that the product keeps full precision near pitch = +-90 degrees, where roll
    and yaw alone are ill defined.
    """
    yaw = float(np.arctan2(rotation[1, 0], rotation[0, 0]))
    c, s = np.cos(yaw), np.sin(yaw)
    level = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation
    pitch = float(np.arctan2(-level[2, 0], level[0, 0]))
    roll = float(np.arctan2(-level[1, 2], level[1, 1]))
    return roll, pitch, yaw


def _numbers(values: object) -> str:
    """Write numbers so that reading them gives the same bits back."""
    return " ".join(
        repr(float(v) + 0.0) for v in np.asarray(values, dtype=np.float64).ravel()
    )


def _origin(pose: pin.SE3) -> Element:
    return Element(
        "origin", xyz=_numbers(pose.translation), rpy=_numbers(rpy_of(pose.rotation))
    )


def _fixed(name: str, parent: str, child: str, placed: Posed) -> Element:
    return _connection(name, "fixed", parent, child, placed)


def _connection(
    name: str, kind: str, parent: str, child: str, placed: Posed
) -> Element:
    joint = Element("joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    joint.append(_origin(se3_of(placed)))
    return joint


def _joint(robot: RobotDescription, link: Link) -> Element:
    if link.parent is None:
        kinds = {"fixed": "fixed", "free": "floating", "planar": "planar"}
        kind = kinds[robot.root.kind]
        pose = Posed() if kind == "floating" else robot.root
        element = _connection("root", kind, "world", link.name, pose)
        if kind == "planar":
            ElementTree.SubElement(element, "axis", xyz="0 0 1")
        return element
    if link.joint is None:
        return _fixed(f"{link.name}_fixed", link.parent, link.name, link)
    joint = link.joint
    kinds = {"hinge": "revolute" if joint.range else "continuous", "slide": "prismatic"}
    element = _connection(joint.name, kinds[joint.type], link.parent, link.name, link)
    ElementTree.SubElement(element, "axis", xyz=_numbers(joint.axis))
    element.append(_limit(joint))
    if joint.damping or joint.frictionloss:
        ElementTree.SubElement(
            element,
            "dynamics",
            damping=_numbers(joint.damping),
            friction=_numbers(joint.frictionloss),
        )
    if joint.mimic is not None:
        ElementTree.SubElement(
            element,
            "mimic",
            joint=joint.mimic.joint,
            multiplier=_numbers(joint.mimic.ratio),
            offset=_numbers(joint.mimic.offset),
        )
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
    if link.mass > 0.0:
        element.append(_inertial(link))
    for kind, shapes in (("visual", link.visual), ("collision", link.collision)):
        for index, shape in enumerate(shapes):
            stem = f"{link.name}_{kind}{index}"
            for pose, geometry in _primitives(shape, stem, mesh_dir):
                item = ElementTree.SubElement(element, kind)
                item.append(_origin(pose))
                ElementTree.SubElement(item, "geometry").append(geometry)
                if kind == "visual":
                    item.append(_material(robot, shape))
    return element


def _inertial(link: Link) -> Element:
    element = Element("inertial")
    element.append(_origin(pin.SE3(np.eye(3), np.asarray(link.com))))
    ElementTree.SubElement(element, "mass", value=_numbers(link.mass))
    xx, yy, zz, xy, xz, yz = (_numbers(v) for v in link.inertia)
    ElementTree.SubElement(
        element, "inertia", ixx=xx, ixy=xy, ixz=xz, iyy=yy, iyz=yz, izz=zz
    )
    return element


def _material(robot: RobotDescription, shape: Shape) -> Element:
    if isinstance(shape.color, str) and shape.color in robot.materials:
        return Element("material", name=shape.color)
    color = (0.5, 0.5, 0.52) if isinstance(shape.color, str) else shape.color
    rgba = (*color, 1.0)[:4]
    name = "rgba_" + "_".join(f"{round(255 * c):03d}" for c in rgba)
    material = Element("material", name=name)
    ElementTree.SubElement(material, "color", rgba=_numbers(rgba))
    return material


def _primitives(
    shape: Shape, stem: str, mesh_dir: Path | None
) -> Iterator[tuple[pin.SE3, Element]]:
    """Yield the poses and geometries that make up one shape."""
    own = se3_of(shape)
    mesh = None if mesh_dir is None else mesh_of(shape)
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
            pose, length = _along(shape)
            radius = _numbers(shape.radius)
            cylinder = Element("cylinder", radius=radius, length=_numbers(length))
            yield own * pose, cylinder
            if isinstance(shape, Capsule):
                for end in (shape.start, shape.end):
                    ball = Element("sphere", radius=radius)
                    yield own * pin.SE3(np.eye(3), np.asarray(end)), ball
        case _:
            yield _enclosing_box(shape)


def _along(shape: Capsule | Cylinder) -> tuple[pin.SE3, float]:
    """Return the pose of a cylinder along z in its shape's frame, and its length."""
    start, end = np.asarray(shape.start), np.asarray(shape.end)
    length = float(np.linalg.norm(end - start))
    turn = pin.Quaternion.FromTwoVectors(np.eye(3)[2], (end - start) / length)
    return pin.SE3(turn.matrix(), (start + end) / 2), length


def _enclosing_box(shape: Shape) -> tuple[pin.SE3, Element]:
    """Return the smallest box along the axes of the shape's own frame."""
    level = shape.model_copy(update=pose_fields(pin.SE3.Identity()))
    low, high = shape_bounds(level)
    centre = pin.SE3(np.eye(3), (low + high) / 2)
    return se3_of(shape) * centre, Element("box", size=_numbers(high - low))
