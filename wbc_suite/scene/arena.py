"""Arenas: floor, sky, lights and tables."""

import itertools
from collections.abc import Mapping
from typing import Annotated, TypeAlias

import mujoco
from pydantic import Field, model_validator

from wbc_suite.config_files import FrozenModel
from wbc_suite.robot.shapes import Size, Vector3
from wbc_suite.scene.compose import add_camera
from wbc_suite.scene.materials import FRICTION, add_texture, wood_pixels

WOOD_SIZE = 512  # pixels along each side of the table's texture

LEG_AT = 0.5
"""Distance of a table's legs from its middle, as a share of half its side; further out
they would stand on the feet of robots' pedestals, which reach 24 cm under it."""

FLOOR = "floor"
"""Name of the plane that robots stand on, in every scene."""

LEAST_LEG = 0.01  # shortest legs of a table, m

Friction: TypeAlias = Annotated[float, Field(ge=0.0, le=1e3)]


class TableConfig(FrozenModel):
    """A table: length, width and thickness of its top, middle of its upper face, m.

    Attributes:
        geom: Geom of the arena that is the top; nothing is added then.
    """

    size: tuple[Size, Size, Size] = (0.8, 0.8, 0.05)
    center: Vector3 = (0.0, 0.0, 0.8)
    friction: tuple[Friction, Friction, Friction] = FRICTION
    geom: str | None = None

    @model_validator(mode="after")
    def _stands_on_the_floor(self) -> "TableConfig":
        if self.center[2] - self.size[2] < LEAST_LEG:
            raise ValueError(
                f"a top {self.size[2]} m thick at {self.center[2]} m has no room for "
                "legs"
            )
        return self


def empty_arena(*, timestep: float = 0.002) -> mujoco.MjSpec:
    """Return an arena with floor, sky and soft light, and the physics options set."""
    spec = bare_arena(timestep=timestep)
    add_sky(spec)
    add_floor(spec)
    add_lights(spec)
    return spec


def bare_arena(*, timestep: float = 0.002) -> mujoco.MjSpec:
    """Return an arena of no elements but tables' materials, with the options set.

    Implicit integration keeps stiff servos and damping stable; dense Jacobians avoid a
    fault of the sparse Newton path in MuJoCo 4.0.0.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "scene"
    spec.compiler.degree = False
    spec.compiler.savecompiled = False
    option = spec.option
    option.timestep = timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 10.0
    spec.memory = 64 * 2**20
    spec.visual.headlight.ambient = (0.34, 0.34, 0.35)
    spec.visual.headlight.diffuse = (0.28, 0.28, 0.28)
    spec.visual.headlight.specular = (0.05, 0.05, 0.05)
    spec.visual.map.znear = 0.005
    spec.visual.map.shadowclip = 6.0  # extents; at its edge the floor is full of dots
    spec.visual.rgba.haze = (0.80, 0.83, 0.86, 1.0)  # white is a bar at the horizon
    wood = spec.add_material(name="wood", specular=0.2, shininess=0.3)
    planks = wood_pixels(WOOD_SIZE)
    add_texture(spec, wood, mujoco.mjtTexture.mjTEXTURE_2D, planks)
    wood.texrepeat = (1, 1)
    spec.add_material(name="table_leg", rgba=(0.32, 0.33, 0.35, 1), specular=0.4)
    return spec


def add_table(spec: mujoco.MjSpec, table: TableConfig, name: str = "table") -> None:
    """Add a table on four legs; body and top are called `name`.

    A surface is there already, and nothing is added.
    """
    if table.geom is not None:
        return
    length, width, thickness = table.size
    height = table.center[2] - thickness
    body = spec.worldbody.add_body(name=name, pos=table.center)
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=(0, 0, -thickness / 2),
        size=(length / 2, width / 2, thickness / 2),
        material="wood",
        friction=table.friction,
    )
    x, y, z = LEG_AT * length / 2, LEG_AT * width / 2, -thickness - height / 2
    for i, (side, end) in enumerate(itertools.product((-1, 1), repeat=2)):
        body.add_geom(
            name=f"{name}_leg{i}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=(side * x, end * y, z),
            size=(0.025, 0.025, height / 2),
            material="table_leg",
        )


def add_tables(
    spec: mujoco.MjSpec, table: TableConfig, centers: Mapping[str, Vector3]
) -> None:
    """Add equal tables at the middles of their tops' upper faces, m, by name."""
    for name, center in centers.items():
        given = table.model_dump() | {"center": center}
        add_table(spec, TableConfig.model_validate(given), name)


def add_table_cameras(
    spec: mujoco.MjSpec, center: Vector3, *, side: float = -1.0, before: float = 0.75
) -> None:
    """Add the cameras of table-top benchmarks, under the names of existing datasets.

    `center` is the middle of the table's upper face, m. `sideview` looks from the side
    -1 (-y) or 1 (+y), `agentview` from `before` the middle along x, m.
    """
    x, y, z = center
    middle = (x - 0.15, y, z + 0.25)
    add_camera(spec, "frontview", (x + 1.9, y, z + 0.75), middle)
    add_camera(spec, "agentview", (x + before, y, z + 0.75), (x - 0.1, y, z + 0.1))
    add_camera(spec, "sideview", (x - 0.1, y + 1.9 * side, z + 0.65), middle)
    add_camera(spec, "birdview", (x - 0.2, y, z + 2.2), (x - 0.2, y, z))


def add_sky(spec: mujoco.MjSpec) -> None:
    """Add a bright sky."""
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.93, 0.95, 0.97),
        rgb2=(0.62, 0.68, 0.75),
        width=64,  # a gradient needs no more, and every environment holds it
        height=384,
    )


def add_floor(spec: mujoco.MjSpec, *, drawn: bool = True) -> None:
    """Add the plane that robots stand on."""
    geom = spec.worldbody.add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0, 0, 0.05),
        friction=FRICTION,
    )
    if not drawn:
        geom.rgba[3] = 0.0
        return
    geom.material = "floor"
    spec.add_texture(
        name="floor",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=(0.79, 0.80, 0.80),
        rgb2=(0.79, 0.80, 0.80),
        mark=mujoco.mjtMark.mjMARK_EDGE,
        markrgb=(0.71, 0.72, 0.73),
        width=512,
        height=512,
    )
    floor = spec.add_material(name="floor", reflectance=0.04, specular=0.1)
    floor.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
    floor.texrepeat = (1, 1)
    floor.texuniform = True


def add_lights(spec: mujoco.MjSpec) -> None:
    """Add two soft lights, one of which casts shadows."""
    for name, pos, diffuse, shadow in (
        ("key_light", (-1.5, -2.0, 4.0), 0.5, True),
        ("fill_light", (2.0, 2.0, 3.0), 0.2, False),
    ):
        spec.worldbody.add_light(
            name=name,
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            pos=pos,
            dir=tuple(-p for p in pos),
            diffuse=(diffuse,) * 3,
            specular=(0.2,) * 3,
            castshadow=shadow,
        )
