"""Write shapes as MuJoCo geoms: collision geoms, and one visual mesh per link.

Each geom costs time in every physics step (135 of 175 geoms in a scene with a Panda are
only drawn), so the opaque shapes of a link are merged into one mesh. Its vertices refer
to pixels of a small texture, the palette, because a mesh has one colour.
"""

from functools import lru_cache

import mujoco
import numpy as np

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Link
from wbc_suite.robot.poses import se3_of
from wbc_suite.robot.shape_geometry import along_z, mesh_of
from wbc_suite.robot.shapes import (
    Box,
    Capsule,
    Cylinder,
    Drawn,
    Ellipsoid,
    Posed,
    Rgba,
    Sphere,
)
from wbc_suite.robot.triangle_meshes import (
    TriangleMesh,
    box_mesh,
    capsule_mesh,
    creased,
    cylinder_mesh,
    ellipsoid_mesh,
    merge,
)
from wbc_suite.typing import Indices, Matrix

VISUAL_GROUP = 2  # geom group of shapes that are only drawn
COLLISION_GROUP = 3  # geom group of shapes that only collide

STATED_SOLMIX = 1000.0
"""Weight of a stated contact stiffness, so that it prevails over the default (1): a pad
sinks 0.2 mm into a cube of 0.1 kg, and 3.4 mm with equal weights."""

GREY = (0.5, 0.5, 0.52, 1.0)
PALETTE = "palette"
ROW = 4  # row alignment of OpenGL textures, in pixels


def add_collision_geoms(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, robot: RobotDescription, link: Link
) -> None:
    """Add the collision shapes of a link to its body."""
    for index, shape in enumerate(link.collision):
        geom = _add_geom(spec, body, shape, f"{link.name}_collision{index}")
        geom.group, geom.mass, geom.rgba = COLLISION_GROUP, 0.0, rgba_of(robot, shape)
        if shape.solref is not None:
            geom.solref[:2] = shape.solref
            geom.solmix = STATED_SOLMIX
        for key in ("friction", "condim", "margin", "priority"):
            if (value := getattr(shape, key)) is not None:
                setattr(geom, key, value)


class VisualGeoms:
    """Adds the visual geoms of the links of a robot, `merged` or one per shape."""

    def __init__(
        self, spec: mujoco.MjSpec, robot: RobotDescription, *, merged: bool
    ) -> None:
        self._spec, self._robot, self._merged = spec, robot, merged
        self._colors: dict[Rgba, int] = {}
        if not merged:
            return
        for link in robot.links:
            for shape in robot.drawn(link):
                self._colors.setdefault(rgba_of(robot, shape), len(self._colors))
        if len(self._colors) > 1:
            self._add_palette()

    def add(self, body: mujoco.MjsBody, link: Link) -> None:
        """Add the geoms of a link to its body.

        Transparent shapes are not merged, because MuJoCo sorts them by depth.
        """
        shapes = [(rgba_of(self._robot, s), s) for s in self._robot.drawn(link)]
        solid, single = [], shapes
        if self._merged and sum(rgba[3] == 1.0 for rgba, _ in shapes) > 1:
            solid = [(rgba, shape) for rgba, shape in shapes if rgba[3] == 1.0]
            single = [(rgba, shape) for rgba, shape in shapes if rgba[3] != 1.0]
            self._add_merged(body, solid, f"{link.name}_visual0")
        for index, (rgba, shape) in enumerate(single, start=bool(solid)):
            geom = _add_geom(self._spec, body, shape, f"{link.name}_visual{index}")
            geom.rgba = rgba
            _disable_contacts(geom)

    def _add_merged(
        self, body: mujoco.MjsBody, shapes: list[tuple[Rgba, Drawn]], name: str
    ) -> None:
        mesh, owner = _merged(tuple(shape for _, shape in shapes))
        added = _add_mesh(self._spec, name, mesh.vertices, mesh.faces)
        geom = body.add_geom(name=name)
        geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, name
        _disable_contacts(geom)
        if len({rgba for rgba, _ in shapes}) == 1:
            geom.rgba = shapes[0][0]
            return
        geom.material = PALETTE
        pixels = np.array([self._colors[rgba] for rgba, _ in shapes])[owner]
        u = (pixels + 0.5) / self._width
        added.usertexcoord = np.column_stack([u, np.full(len(u), 0.5)]).ravel().tolist()
        added.userfacetexcoord = mesh.faces.ravel().tolist()

    @property
    def _width(self) -> int:
        return -(-len(self._colors) // ROW) * ROW

    def _add_palette(self) -> None:
        pixels = np.zeros((self._width, 3), dtype=np.uint8)
        for rgba, index in self._colors.items():
            pixels[index] = np.rint(255.0 * np.clip(rgba[:3], 0.0, 1.0))
        texture = self._spec.add_texture(
            name=PALETTE,
            type=mujoco.mjtTexture.mjTEXTURE_2D,
            nchannel=3,
            width=self._width,
            height=1,
        )
        texture.data = pixels.tobytes()
        material = self._spec.add_material(name=PALETTE)
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = PALETTE


def rgba_of(robot: RobotDescription, shape: Drawn) -> Rgba:
    """Return the colour of a shape: that of its material, or its own values."""
    color = shape.color
    if isinstance(color, str):
        return robot.materials.get(color, GREY)
    return (color[0], color[1], color[2], color[3] if len(color) == 4 else 1.0)


def _disable_contacts(geom: mujoco.MjsGeom) -> None:
    geom.contype = geom.conaffinity = 0
    geom.group, geom.mass = VISUAL_GROUP, 0.0


def _add_mesh(
    spec: mujoco.MjSpec, name: str, vertices: Matrix, faces: Indices
) -> mujoco.MjsMesh:
    return spec.add_mesh(
        name=name,
        uservert=vertices.ravel().tolist(),  # lists are twice as fast as arrays
        userface=faces.ravel().tolist(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )


def _add_geom(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, shape: Drawn, name: str
) -> mujoco.MjsGeom:
    """Add a shape to a body, as a primitive or as a mesh of the same name."""
    mesh = mesh_of(shape)
    geom = body.add_geom(name=name, pos=shape.pos, quat=shape.quat)
    kinds = mujoco.mjtGeom
    if mesh is not None:
        _add_mesh(spec, name, *mesh)
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


@lru_cache(maxsize=1024)
def _merged(shapes: tuple[Drawn, ...]) -> tuple[TriangleMesh, Indices]:
    """Return one mesh in the link's frame, and the index of each vertex's shape.

    Equal links share the result.
    """
    meshes = [triangles_of(shape) for shape in shapes]
    counts = [len(mesh.vertices) for mesh in meshes]
    return merge(meshes), np.repeat(np.arange(len(meshes)), counts)


def triangles_of(shape: Drawn) -> TriangleMesh:
    """Return the surface of a shape in the axes of its link."""
    pose, mesh = Posed(pos=shape.pos, quat=shape.quat), mesh_of(shape)
    if mesh is not None:
        triangles = creased(TriangleMesh(*mesh))
    else:
        match shape:
            case Box(size=size):
                triangles = box_mesh(np.asarray(size))
            case Ellipsoid(size=size):
                triangles = ellipsoid_mesh(np.asarray(size))
            case Sphere(radius=radius):
                triangles = ellipsoid_mesh(np.full(3, radius))
            case Capsule() | Cylinder():
                solid = capsule_mesh if isinstance(shape, Capsule) else cylinder_mesh
                pose, half = along_z(shape)
                triangles = solid(shape.radius, half)
            case _:
                raise AssertionError(f"no triangles for shape {shape.shape}")
    placed = se3_of(pose)
    return triangles.moved(placed.translation, placed.rotation)
