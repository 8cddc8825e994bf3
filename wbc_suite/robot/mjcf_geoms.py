"""MuJoCo's geoms of single shapes, and those that a link collides with."""

import math

import mujoco

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.parts import Link
from wbc_suite.robot.placing import compose
from wbc_suite.robot.shapes import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Posed,
    Shape,
    SkinMesh,
    Sphere,
)
from wbc_suite.robot.surfaces import mesh_of

__all__ = [
    "COLLISION_GROUP",
    "Drawn",
    "Rgba",
    "add_collision_geoms",
    "add_geom",
    "along_z",
    "rgba_of",
]

COLLISION_GROUP = 3
"""Geom group of shapes that only collide."""

STATED_SOLMIX = 1000.0
"""Weight of a stated contact stiffness against the default of 1: who states it wins.

Mixed half and half, a pad sinks 3.4 mm into a cube of 0.1 kg; like this 0.2 mm.
"""

DOWN = (0.0, 1.0, 0.0, 0.0)
"""The turn from z to -z."""
GREY = (0.5, 0.5, 0.52, 1.0)

Drawn = Shape | SkinMesh
Rgba = tuple[float, float, float, float]


def add_collision_geoms(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, robot: RobotDescription, link: Link
) -> None:
    """Add what a link collides with to its body."""
    for index, shape in enumerate(link.collision):
        geom = add_geom(spec, body, shape, f"{link.name}_collision{index}")
        geom.group, geom.mass, geom.rgba = COLLISION_GROUP, 0.0, rgba_of(robot, shape)
        _set_contact(geom, shape)


def rgba_of(robot: RobotDescription, shape: Drawn) -> Rgba:
    """Return the colour of a shape, by name or by its own numbers."""
    color = shape.color
    if isinstance(color, str):
        return robot.materials.get(color, GREY)
    return (color[0], color[1], color[2], color[3] if len(color) == 4 else 1.0)


def _set_contact(geom: mujoco.MjsGeom, shape: Shape) -> None:
    if shape.friction is not None:
        geom.friction = shape.friction
    if shape.condim is not None:
        geom.condim = shape.condim
    if shape.solref is not None:
        geom.solref[:2] = shape.solref
        geom.solmix = STATED_SOLMIX
    if shape.margin is not None:
        geom.margin = shape.margin


def add_geom(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, shape: Drawn, name: str
) -> mujoco.MjsGeom:
    """Add a shape to a body, as a primitive or as a mesh of the same name."""
    mesh = mesh_of(shape)
    geom = body.add_geom(name=name, pos=shape.pos, quat=shape.quat)
    kinds = mujoco.mjtGeom
    if mesh is not None:
        vertices, faces = mesh
        spec.add_mesh(
            name=name,
            uservert=vertices.ravel().tolist(),  # twice as fast as arrays
            userface=faces.ravel().tolist(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        geom.type, geom.meshname = kinds.mjGEOM_MESH, name
        return geom
    match shape:
        case Box(size=size):
            geom.type, geom.size = kinds.mjGEOM_BOX, size
        case Ellipsoid(size=size):
            geom.type, geom.size = kinds.mjGEOM_ELLIPSOID, size
        case Sphere(radius=radius):
            geom.type, geom.size = kinds.mjGEOM_SPHERE, (radius, 0, 0)
        case Capsule() | Cylinder():
            capsule = isinstance(shape, Capsule)
            geom.type = kinds.mjGEOM_CAPSULE if capsule else kinds.mjGEOM_CYLINDER
            pose, half = along_z(shape)
            geom.pos, geom.quat = pose.pos, pose.quat
            geom.size = (shape.radius, half, 0)
        case _:
            raise AssertionError(f"no geom for shape {shape.shape}")
    return geom


def along_z(shape: Capsule | Cylinder) -> tuple[Posed, float]:
    """Return the pose in which z runs along the segment, and its half length."""
    (ax, ay, az), (bx, by, bz) = shape.start, shape.end
    length = math.dist(shape.start, shape.end)
    x, y, z = (bx - ax) / length, (by - ay) / length, (bz - az) / length
    half = math.hypot(x, y, 1.0 + z)  # the shortest turn from z is half way to it
    turn = ((1.0 + z) / half, -y / half, x / half, 0.0) if half > 1e-9 else DOWN
    middle = ((ax + bx) / 2, (ay + by) / 2, (az + bz) / 2)
    return Posed(**compose(shape, Posed(pos=middle, quat=turn))), length / 2
