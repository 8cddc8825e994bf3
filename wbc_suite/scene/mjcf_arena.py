"""MuJoCo scenes as arenas: the world of an MJCF file around a benchmark."""

import logging
import math
from collections.abc import Iterator, Sequence
from itertools import count
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite import logs
from wbc_suite.config_files import FrozenModel
from wbc_suite.errors import ConfigError, UnknownNameError, join_first
from wbc_suite.robot.mjcf_compile import compile_mjcf
from wbc_suite.robot.poses import pose_at, pose_fields
from wbc_suite.robot.shapes import Real, Vector3
from wbc_suite.scene.arena import (
    FLOOR,
    TableConfig,
    add_floor,
    add_lights,
    add_sky,
    bare_arena,
)
from wbc_suite.scene.surfaces import (
    ABOVE,
    BELOW,
    LEAST,
    Surface,
    box_tops,
    free_side,
    suits,
    surface_at_site,
    surface_of_geom,
)
from wbc_suite.typing import Vector

log = logs.logger(__name__)

PREFIX = "arena_"
"""Text before every name of the file in the composed scene."""
OWN = "own"
ON_SITES = int(mujoco.mjtTrn.mjTRN_SITE), int(mujoco.mjtTrn.mjTRN_SLIDERCRANK)
NEAR_EDGE = 0.25
"""Distance of the benchmark's origin from the front edge of a surface, at most, m:
pedestals, whose feet reach under tables, then stand before a cupboard."""
FLAT = 0.01  # height of a top that is a floor, m
IN_VIEW = 0.15  # height over a surface of the point that cameras must see, m


class ArenaConfig(FrozenModel):
    """An MJCF scene, and the place of a benchmark in it; m and rad, in its frame.

    Attributes:
        file: The scene; its meshes and textures lie beside it.
        surface: Geom or site that replaces the benchmark's table, or `own` for that
            table itself; by default the highest level box near the table's height.
        at: Point at the benchmark's origin; by default such that the surface is where
            the table would be.
        yaw: The benchmark's +x, along which a single robot looks; by default towards
            the surface from a side where nothing stands.
        things: Bodies with joints that are observed; by default all.
    """

    file: Path
    surface: str | None = None
    at: tuple[Real, Real] | None = None
    yaw: Real | None = None
    things: tuple[str, ...] | None = None

    def with_surface(self, table: TableConfig) -> "tuple[ArenaConfig, TableConfig]":
        """Return the complete place, and the surface in place of a table.

        Raises:
            ConfigError: If the scene has no such surface, or no room before it.
        """
        if self.surface == OWN:
            return self, table
        m, data = _compiled(self.load())
        top = self._find(m, data, table)
        side = self._side(m, data, top)
        heading, depth, width = top.from_side(side)
        size = (
            min(depth, 2 * NEAR_EDGE, table.size[0]),
            min(width, table.size[1]),
            table.size[2],
        )
        yaw = heading if self.yaw is None else self.yaw
        cos, sin = math.cos(yaw), math.sin(yaw)
        (px, py, height), (x, y, _) = top.middle.tolist(), table.center
        ahead = (size[0] - depth) / 2 - x  # from the middle to the origin, along yaw
        at = px + ahead * cos + y * sin, py + ahead * sin - y * cos
        at = at if self.at is None else self.at
        log.info(
            "%s: '%s' at %.3f m is the table; the benchmark's origin is at x %.3f, "
            "y %.3f m, its +x at %.0f degrees.",
            *(self.file, top.name, height, *at, math.degrees(yaw)),
        )
        surface = TableConfig(
            size=size,
            center=(x, y, height),
            friction=table.friction,
            geom=PREFIX + top.name,
        )
        return self.model_copy(update={"at": at, "yaw": yaw}), surface

    def _find(
        self, m: mujoco.MjModel, data: mujoco.MjData, table: TableConfig
    ) -> Surface:
        """Return the surface that is named, or the highest that suits."""
        if self.surface is None:
            return self._choose(box_tops(m, data), table.center[2])
        geoms = {m.geom(i).name: i for i in range(m.ngeom) if m.geom(i).name}
        sites = {m.site(i).name: i for i in range(m.nsite) if m.site(i).name}
        if self.surface in geoms:
            found = surface_of_geom(m, data, geoms[self.surface])
        elif self.surface in sites:
            index, sides = sites[self.surface], table.size[:2]
            found = surface_at_site(m, data, index, sides)
        else:
            known = [*geoms, *sites]
            raise UnknownNameError(f"surface in {self.file}", self.surface, known)
        if found is None:
            raise ConfigError(
                f"{self.file}: '{self.surface}' is not level within 1 degree. Name "
                "another geom, or a level site on it."
            )
        return found

    def _choose(self, tops: list[Surface], height: float) -> Surface:
        for top in tops:
            if suits(top, height):
                return top
        shown = [
            f"{top.name} at {top.middle[2]:.2f} m of "
            f"{top.sides[0]:.2f} x {top.sides[1]:.2f} m"
            for top in tops
        ]
        raise ConfigError(
            f"{self.file}: no level box of {LEAST} x {LEAST} m or more has its top "
            f"{height - BELOW:.2f} to {height + ABOVE:.2f} m above the floor. Found: "
            f"{join_first(shown) or 'none'}. Name a geom or site as `surface`, or keep "
            f"the benchmark's table by surface = '{OWN}'."
        )

    def _side(self, m: mujoco.MjModel, data: mujoco.MjData, top: Surface) -> int:
        """Return the side of a surface that the benchmark's robots stand at."""
        if self.yaw is not None:
            turned = [top.from_side(k)[0] - self.yaw for k in range(4)]
            return int(np.argmax(np.cos(turned)))
        side = free_side(m, data, top)
        if side is None:
            raise ConfigError(
                f"{self.file}: no side of '{top.name}' has room for a robot. Give "
                "`yaw`, or name another `surface`."
            )
        return side

    def load(self, level: int = logging.DEBUG) -> mujoco.MjSpec:
        """Return the scene without robots, its geoms, joints and things named.

        What is left out is logged at a level.

        Raises:
            ConfigError: If the file is wrong; see `compile_mjcf`.
        """
        m, spec = compile_mjcf(self.file)
        if dropped := _drop_robots(spec, m):
            log.log(
                level,
                "%s: left out what its actuators move: %s. Choose robots by `robots`.",
                *(self.file, join_first(dropped)),
            )
        for key in list(spec.keys):
            spec.delete(key)
        _name(spec.geoms, "geom")
        _name(spec.joints, "joint")
        _name([body for body in spec.bodies if body.joints], "thing")
        return spec

    def build(self) -> mujoco.MjSpec:
        """Return a new scene with this world, turned and moved to the benchmark."""
        spec, own = bare_arena(), self.load(logging.WARNING)
        own.option, own.visual = spec.option, spec.visual
        own_floor = _floor(own)
        height = 0.0 if own_floor is None else own_floor.pos[2]
        yaw, (x, y) = self.yaw or 0.0, self.at or (0.0, 0.0)
        cos, sin = math.cos(yaw), math.sin(yaw)
        frame = spec.worldbody.add_frame(
            pos=(-cos * x - sin * y, sin * x - cos * y, -height),
            quat=(math.cos(yaw / 2), 0.0, 0.0, -math.sin(yaw / 2)),
        )
        floor = None
        if own_floor is not None:
            floor = own_floor.name = own_floor.name or FLOOR
        lit = bool(own.lights)
        covered = own_floor is None and any(
            abs(top.middle[2]) < FLAT for top in box_tops(*_compiled(own))
        )
        skies = any(t.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX for t in own.textures)
        spec.attach(own, prefix=PREFIX, frame=frame)
        if floor is not None:
            spec.geom(PREFIX + floor).name = FLOOR
        else:
            add_floor(spec, drawn=not covered)
        if not lit:
            add_lights(spec)
        if not skies:
            add_sky(spec)
        return spec

    def thing_names(self, m: mujoco.MjModel) -> tuple[str, ...]:
        """Return the file's bodies with joints, in the composed scene.

        Raises:
            UnknownNameError: If `things` has one that is not there.
        """
        names = [m.body(int(body)).name for body in dict.fromkeys(m.jnt_bodyid)]
        found = [n.removeprefix(PREFIX) for n in names if n.startswith(PREFIX)]
        for name in self.things or ():
            if name not in found:
                raise UnknownNameError(f"thing in {self.file}", name, found)
        return tuple(found if self.things is None else self.things)


def _compiled(spec: mujoco.MjSpec) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return a scene's model, and where all is at its start."""
    m = spec.compile()
    data = mujoco.MjData(m)
    mujoco.mj_kinematics(m, data)
    return m, data


def _floor(spec: mujoco.MjSpec) -> mujoco.MjsGeom | None:
    """Return the first plane of the world."""
    planes = mujoco.mjtGeom.mjGEOM_PLANE
    return next((g for g in spec.worldbody.geoms if g.type == planes), None)


def _name(items: Sequence[Any], kind: str) -> None:
    """Name the elements that have no name."""
    known = {item.name for item in items}
    free = (n for n in (f"{kind}{i}" for i in count()) if n not in known)
    for item in items:
        item.name = item.name or next(free)


def _drop_robots(spec: mujoco.MjSpec, m: mujoco.MjModel) -> list[str]:
    """Delete the trees of bodies that actuators move; return the names of the roots."""
    roots = {int(m.body_rootid[body]) for body in _driven_bodies(m)} - {0}
    robots = [spec.bodies[root] for root in roots]
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    names = [robot.name or "unnamed" for robot in robots]
    for robot in robots:
        spec.delete(robot)
    return names


def _driven_bodies(m: mujoco.MjModel) -> Iterator[int]:
    """Yield the bodies that actuators act on."""
    for kind, target in zip(m.actuator_trntype, m.actuator_trnid[:, 0], strict=True):
        if kind == mujoco.mjtTrn.mjTRN_BODY:
            yield int(target)
        elif kind == mujoco.mjtTrn.mjTRN_TENDON:
            first, count = m.tendon_adr[target], m.tendon_num[target]
            for wrap in range(first, first + count):
                joint = m.wrap_type[wrap] == mujoco.mjtWrap.mjWRAP_JOINT
                owners = m.jnt_bodyid if joint else m.site_bodyid
                yield int(owners[m.wrap_objid[wrap]])
        elif kind in ON_SITES:
            yield int(m.site_bodyid[target])
        else:
            yield int(m.jnt_bodyid[target])


def clear_views(m: mujoco.MjModel, data: mujoco.MjData, center: Vector3) -> None:
    """Turn the benchmark's cameras about the vertical through a point till they see it.

    They look from in front of a table, where the walls of a room may be.
    """
    middle = np.array(center) + np.array([0.0, 0.0, IN_VIEW])
    for camera in np.flatnonzero(m.cam_bodyid == 0):
        if m.camera(camera).name.startswith(PREFIX):
            continue
        place = pose_at(m.cam_pos[camera], m.cam_quat[camera])
        for step in sorted(range(-5, 7), key=abs):
            R = pin.utils.rotate("z", step * math.pi / 6)
            eye = middle + R @ (place.translation - middle)
            if not _is_hidden(m, data, eye, middle):
                pose = pose_fields(pin.SE3(R @ place.rotation, eye))
                m.cam_pos[camera], m.cam_quat[camera] = pose["pos"], pose["quat"]
                break


def _is_hidden(
    m: mujoco.MjModel, data: mujoco.MjData, eye: Vector, middle: Vector
) -> bool:
    """Whether the arena hides a point from an eye, or the eye from the point."""
    hit = np.zeros(1, dtype=np.int32)
    for start, end in ((eye, middle), (middle, eye)):
        share = mujoco.mj_ray(m, data, start, end - start, None, True, -1, hit)
        found = m.geom(hit[0]).name if hit[0] >= 0 else ""
        if 0.0 <= share < 1.0 and found.startswith(PREFIX):
            return True
    return False
