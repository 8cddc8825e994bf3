"""Objects of a scene: bodies made of parts, with child objects on hinges."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, TypeAlias

import mujoco
import numpy as np

from wbc_suite.errors import ConfigError, DescriptionError
from wbc_suite.robot.mjcf_compile import compile_mjcf
from wbc_suite.robot.shape_geometry import mesh_of
from wbc_suite.robot.shapes import Box, Cylinder, Hull, Loft, Vector3
from wbc_suite.scene.materials import material_named, use_material
from wbc_suite.scene.objects.grasp_site import GraspSite

Color: TypeAlias = tuple[float, float, float, float]
Quat: TypeAlias = tuple[float, float, float, float]

STANDING: Quat = (1.0, 0.0, 0.0, 0.0)

DRAWN_GROUP, DRAWN_ONLY_GROUP, HIDDEN_GROUP, SITE_GROUP = 0, 2, 3, 4

CONTACT_SOLREF = (0.02, 2.0)
"""Time constant, s, and damping ratio of contacts: twice critical, so that objects do
not rattle when they are put down."""

SLIDING, TORSION = 3, 4
"""Dimensions of contacts. A box touches with several corners, whose sliding friction
keeps it from turning; a contact at one point needs torsional friction for that."""

FIRM = (0.99, 0.9999)
"""Least and greatest impedance of constraints that hardly give, whatever pushes: the
penetration at rest is `(1 - d) / d` of what the default of 0.95 leaves."""

_KINDS = {
    "box": (mujoco.mjtGeom.mjGEOM_BOX, 3),
    "ball": (mujoco.mjtGeom.mjGEOM_SPHERE, 1),
    "cylinder": (mujoco.mjtGeom.mjGEOM_CYLINDER, 2),
    "capsule": (mujoco.mjtGeom.mjGEOM_CAPSULE, 2),
    "ellipsoid": (mujoco.mjtGeom.mjGEOM_ELLIPSOID, 3),
}


@dataclass(frozen=True, kw_only=True, slots=True)
class Part:
    """One shape of an object.

    Attributes:
        kind: Primitive, or `mesh`, which is computed from `surface`.
        size: As in MJCF: half lengths of a box or ellipsoid; radius of a ball; radius
            and half length along z of a cylinder or capsule, m.
        surface: Shape of a mesh: a hull, a loft, a rounded box or a cone.
        color: Red green blue alpha, 0 to 1, times the material's texture.
        material: Name in `scene.materials`; also gives density and friction.
        solid: Whether it collides and has mass; otherwise it is visual only.
        drawn: Whether it is drawn; visuals may be finer than collision shapes.
        firm: Whether contacts with other firm parts hardly give: for thin walls, and
            what is light and pressed hard.
    """

    kind: Literal["box", "ball", "cylinder", "capsule", "ellipsoid", "mesh"]
    size: tuple[float, ...] = ()
    surface: Hull | Loft | Box | Cylinder | None = None
    pos: Vector3 = (0.0, 0.0, 0.0)
    quat: Quat = STANDING
    color: Color = (0.7, 0.7, 0.7, 1.0)
    material: str = "plastic"
    solid: bool = True
    drawn: bool = True
    firm: bool = False
    density: float | None = None
    friction: Vector3 | None = None

    def __post_init__(self) -> None:
        material_named(self.material)  # or raise
        wanted = _KINDS[self.kind][1] if self.kind in _KINDS else 0
        good = all(0.0 < s < np.inf for s in self.size)
        if len(self.size) != wanted or not good:
            raise ConfigError(
                f"A {self.kind} has {wanted} positive sizes in m, not {self.size}."
            )
        if (self.surface is not None) != (self.kind == "mesh"):
            raise ConfigError("A part has a surface if, and only if, it is a mesh.")

    @property
    def own_density(self) -> float:
        """Density, by default the material's, kg/m^3."""
        default = material_named(self.material).density
        return default if self.density is None else self.density

    def add_to(
        self, spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, *, visual: bool
    ) -> None:
        """Add it to a body of a scene; without `visual` there is no texture."""
        geom = body.add_geom(name=name, pos=self.pos, quat=self.quat, rgba=self.color)
        if visual:
            geom.material = use_material(spec, self.material)
        geom.density = self.own_density
        geom.friction = self.friction or material_named(self.material).friction
        geom.group = DRAWN_GROUP if self.drawn else HIDDEN_GROUP
        if self.solid:
            geom.condim = SLIDING if self.kind == "box" else TORSION
            geom.solref[:2] = CONTACT_SOLREF
            if self.firm:
                geom.solimp[:2] = FIRM
        else:
            geom.contype = geom.conaffinity = 0
            geom.mass = 0.0
            geom.group = DRAWN_ONLY_GROUP
        if self.surface is None:
            geom.type, count = _KINDS[self.kind]
            geom.size[:count] = self.size
        else:
            _add_mesh(spec, geom, self.surface)


def _add_mesh(
    spec: mujoco.MjSpec, geom: mujoco.MjsGeom, surface: Hull | Loft | Box | Cylinder
) -> None:
    mesh = mesh_of(surface)
    if mesh is None:
        raise ConfigError(f"A plain {surface.shape} is a part of its own kind.")
    vertices, faces = mesh
    spec.add_mesh(
        name=geom.name,
        uservert=vertices.ravel().tolist(),
        userface=faces.ravel().tolist(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX,
    )
    geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, geom.name


@dataclass(frozen=True, kw_only=True, slots=True)
class Hinge:
    """Hinge joint between an object and its parent, named `{object}_joint`.

    Its stops hardly give.

    The axis is in the object's frame, through its origin. SI units; `friction` is dry,
    `stiffness` that of a spring to angle zero.
    """

    axis: Vector3
    range: tuple[float, float]
    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    armature: float = 0.0


@dataclass(frozen=True, kw_only=True, slots=True)
class SceneObject:
    """A body made of parts.

    Its joint is `{name}_joint`; a part is `{name}` if it is the only one, else
    `{name}_0`, ...; a site is `{name}_{site}`.

    Attributes:
        sites: Points of interest, in its frame, m.
        motion: `free`, `fixed` (placed at a reset, then still), or a hinge.
        pos: Position in the scene, or on its parent, m.
        children: Objects attached to it.
        grasps: Where and how hands can hold it.
    """

    name: str
    parts: tuple[Part, ...]
    sites: Mapping[str, Vector3] = field(default_factory=dict)
    motion: Literal["free", "fixed"] | Hinge = "free"
    pos: Vector3 = (0.0, 0.0, 0.0)
    quat: Quat = STANDING
    children: "tuple[SceneObject, ...]" = ()
    grasps: tuple[GraspSite, ...] = ()

    def add_to(
        self,
        spec: mujoco.MjSpec,
        parent: mujoco.MjsBody | None = None,
        *,
        visual: bool = True,
    ) -> None:
        """Add it to a scene; without `visual` it has no textures."""
        body = (parent or spec.worldbody).add_body(
            name=self.name, pos=self.pos, quat=self.quat
        )
        if self.motion == "free":
            kind = mujoco.mjtJoint.mjJNT_FREE
            body.add_joint(name=f"{self.name}_joint", type=kind)
        elif isinstance(self.motion, Hinge):
            _add_hinge(body, f"{self.name}_joint", self.motion)
        only = len(self.parts) == 1
        for i, part in enumerate(self.parts):
            name = self.name if only else f"{self.name}_{i}"
            part.add_to(spec, body, name, visual=visual)
        for name, pos in self.sites.items():
            body.add_site(name=f"{self.name}_{name}", pos=pos, group=SITE_GROUP)
        for child in self.children:
            child.add_to(spec, body, visual=visual)

    def family(self) -> "Iterator[SceneObject]":
        """Yield it, its children, and theirs."""
        yield self
        for child in self.children:
            yield from child.family()

    def compiled_alone(self) -> mujoco.MjModel:
        """Compile it as a free body, without textures and children."""
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        replace(self, children=(), motion="free").add_to(spec, visual=False)
        return spec.compile()

    def with_mass(self, mass: float) -> "SceneObject":
        """Return it with its densities scaled to a mass, kg; children keep theirs."""
        factor = mass / float(self.compiled_alone().body_mass.sum())
        parts = tuple(replace(p, density=factor * p.own_density) for p in self.parts)
        return replace(self, parts=parts)

    def fixed(self, pos: Vector3, quat: Quat = STANDING) -> "SceneObject":
        """Return it fixed to the world."""
        return replace(self, motion="fixed", pos=pos, quat=quat)


def _add_hinge(body: mujoco.MjsBody, name: str, hinge: Hinge) -> None:
    joint = body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=hinge.axis,
        frictionloss=hinge.friction,
        armature=hinge.armature,
    )
    joint.damping[0] = hinge.damping
    joint.stiffness[0] = hinge.stiffness
    joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
    joint.range = hinge.range
    joint.solimp_limit[:2] = FIRM


@dataclass(frozen=True, kw_only=True, slots=True)
class MjcfObject:
    """The one body below the world of an MJCF file, with its children.

    The file is untrusted: its size is limited, it may name no file outside of its own
    folder, and it may load no plugins. Its names get the prefix `{name}_`. Joints of
    the body itself are left out.
    """

    name: str
    path: Path | str
    motion: Literal["free", "fixed"] = "free"
    pos: Vector3 = (0.0, 0.0, 0.0)
    quat: Quat = STANDING
    grasps: tuple[GraspSite, ...] = ()

    def family(self) -> "Iterator[MjcfObject]":
        """Yield it: it has no children of its own."""
        yield self

    def __post_init__(self) -> None:
        if not isinstance(self.path, str | Path):
            raise DescriptionError(f"'path' must be a path, not {self.path!r:.60}.")
        object.__setattr__(self, "path", Path(self.path))

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add it to a scene; raises as `compile_mjcf`, and unless it is one body."""
        _, own = compile_mjcf(Path(self.path))
        bodies = own.worldbody.bodies
        if len(bodies) != 1:
            raise DescriptionError(
                f"{self.path}: an object is one body below <worldbody>, not "
                f"{len(bodies)}; put all parts into one body."
            )
        (body,) = bodies
        for joint in list(body.joints):
            own.delete(joint)
        for key in list(own.keys):
            own.delete(key)
        own.option = spec.option  # the scene's count
        if not body.name:
            body.name = self.name
        frame = spec.worldbody.add_frame()
        added = frame.attach_body(body, f"{self.name}_", "")
        added.name, added.pos, added.quat = self.name, self.pos, self.quat
        if self.motion == "free":
            kind = mujoco.mjtJoint.mjJNT_FREE
            added.add_joint(name=f"{self.name}_joint", type=kind)
