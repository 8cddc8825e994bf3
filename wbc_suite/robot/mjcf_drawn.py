"""MuJoCo's geoms that a link is drawn with: one mesh, whatever its shapes and colours.

Each geom of a model is posed anew and bounded in every step of physics, also where it
is only drawn: 135 of 175 geoms in a scene with a Panda. A mesh has one colour in
MuJoCo, so the colours of a robot are the pixels of a small picture, its palette, and
each vertex points to the middle of its pixel.
"""

from functools import lru_cache

import mujoco
import numpy as np

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.mjcf_geoms import Drawn, Rgba, add_geom, along_z, rgba_of
from wbc_suite.robot.parts import Link
from wbc_suite.robot.placing import se3_of
from wbc_suite.robot.shapes import Box, Capsule, Cylinder, Ellipsoid, Posed, Sphere
from wbc_suite.robot.surfaces import mesh_of
from wbc_suite.robot.triangles import (
    TriangleMesh,
    box_mesh,
    capsule_mesh,
    creased,
    cylinder_mesh,
    ellipsoid_mesh,
    merge,
)
from wbc_suite.typing import Indices

__all__ = ["VISUAL_GROUP", "DrawnLinks"]

VISUAL_GROUP = 2
"""Geom group of shapes that are only drawn."""
PALETTE = "palette"
ROW = 4
"""Pixels in a palette are a multiple of it, as OpenGL likes its rows."""


class DrawnLinks:
    """Adds what the links of one robot are drawn with.

    Args:
        spec: Holds meshes and the palette.
        robot: Knows shapes, skins and colours.
        merged: Whether the opaque shapes of a link become one mesh.
    """

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
        """Add the geoms of a link to its body; glass stays in pieces, to be sorted."""
        shapes = [(rgba_of(self._robot, s), s) for s in self._robot.drawn(link)]
        solid, single = [], shapes
        if self._merged and sum(rgba[3] == 1.0 for rgba, _ in shapes) > 1:
            solid = [(rgba, shape) for rgba, shape in shapes if rgba[3] == 1.0]
            single = [(rgba, shape) for rgba, shape in shapes if rgba[3] != 1.0]
            self._add_merged(body, solid, f"{link.name}_visual0")
        for index, (rgba, shape) in enumerate(single, start=bool(solid)):
            geom = add_geom(self._spec, body, shape, f"{link.name}_visual{index}")
            geom.rgba = rgba
            _draw_only(geom)

    def _add_merged(
        self, body: mujoco.MjsBody, shapes: list[tuple[Rgba, Drawn]], name: str
    ) -> None:
        mesh, part = _merged(tuple(shape for _, shape in shapes))
        faces = mesh.faces.ravel().tolist()
        added = self._spec.add_mesh(
            name=name,
            uservert=mesh.vertices.ravel().tolist(),  # twice as fast as arrays
            userface=faces,
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        geom = body.add_geom(name=name)
        geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, name
        _draw_only(geom)
        if len({rgba for rgba, _ in shapes}) == 1:
            geom.rgba = shapes[0][0]
            return
        geom.material = PALETTE
        u = np.array([self._place(rgba) for rgba, _ in shapes])[part]
        added.usertexcoord = np.column_stack([u, np.full(len(u), 0.5)]).ravel().tolist()
        added.userfacetexcoord = faces

    def _place(self, rgba: Rgba) -> float:
        """Return where a colour is in the palette, from 0 to 1."""
        return (self._colors[rgba] + 0.5) / self._width

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


def _draw_only(geom: mujoco.MjsGeom) -> None:
    geom.contype = geom.conaffinity = 0
    geom.group, geom.mass = VISUAL_GROUP, 0.0


@lru_cache(maxsize=1024)
def _merged(shapes: tuple[Drawn, ...]) -> tuple[TriangleMesh, Indices]:
    """Return one mesh in the link's frame, and of which shape each vertex is.

    Equal links share it.
    """
    meshes = [_triangles(shape) for shape in shapes]
    counts = [len(mesh.vertices) for mesh in meshes]
    return merge(meshes), np.repeat(np.arange(len(meshes)), counts)


def _triangles(shape: Drawn) -> TriangleMesh:
    pose, mesh = Posed(pos=shape.pos, quat=shape.quat), mesh_of(shape)
    if mesh is not None:
        triangles = creased(TriangleMesh(*mesh))
    else:
        match shape:
            case Box(size=size) | Ellipsoid(size=size):
                solid = box_mesh if isinstance(shape, Box) else ellipsoid_mesh
                triangles = solid(np.asarray(size))
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
