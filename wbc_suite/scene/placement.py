"""Samplers of start poses of objects whose upright bounding cylinders are apart."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

from numpy.random import Generator

from wbc_suite.config_files import FrozenModel, parse_model
from wbc_suite.errors import ConfigError, PlacementError
from wbc_suite.registry import Registry
from wbc_suite.robot.shapes import Interval, Real, Vector3
from wbc_suite.scene.objects.object_state import Extent, ObjectState
from wbc_suite.scene.objects.scene_object import STANDING, Quat

TRIES = 300  # poses drawn for one object before all objects are placed again
LAYOUTS = 20  # how often all objects of a sampler are placed before an error
ON_TOP = 1e-9  # tolerance of rounding between an object and its support, m


@dataclass(frozen=True, kw_only=True, slots=True)
class Placed:
    """A placed object: position in m, quaternion w x y z, bounding cylinder."""

    position: Vector3
    quat: Quat
    extent: Extent

    def touches(self, other: "Placed", gap: float) -> bool:
        """Whether two cylinders overlap in height and are nearer than `gap`."""
        (ax, ay, az), (bx, by, bz) = self.position, other.position
        beside = self.extent.radius + other.extent.radius + gap
        if math.hypot(ax - bx, ay - by) >= beside:
            return False
        above = az - self.extent.bottom > bz + other.extent.top - ON_TOP
        below = bz - other.extent.bottom > az + self.extent.top - ON_TOP
        return not (above or below)


Objects: TypeAlias = Mapping[str, ObjectState]
Taken: TypeAlias = Mapping[str, Placed]
Placements: TypeAlias = dict[str, Placed]


class Sampler(Protocol):
    """Draws start poses of some objects."""

    def sample(self, rng: Generator, objects: Objects, taken: Taken) -> Placements:
        """Return a pose for each of the sampler's objects, clear of those `taken`.

        Raises:
            PlacementError: If no free place is found; names what to relax.
        """
        ...


class Region(FrozenModel):
    """Rectangle of a surface with a range of orientations.

    Ranges of x and y are from the surface's origin, m; yaw is about the vertical, rad.

    Attributes:
        clearance: Height above the surface, m.
        inside: Whether objects lie inside entirely, or only their origins.
        gap: Least distance between objects, m.
    """

    x: Interval
    y: Interval
    yaw: Interval = (-math.pi, math.pi)
    clearance: Real = 0.0
    inside: bool = False
    gap: Real = 0.0


@dataclass(frozen=True, kw_only=True, slots=True)
class UniformSampler:
    """Draws poses uniformly in a region, without contact between objects.

    The surface has its origin in the world, m; `rest` is the orientation before the
    turn about the vertical.
    """

    names: Sequence[str]
    region: Region
    origin: Vector3 = (0.0, 0.0, 0.0)
    rest: Quat = STANDING

    def sample(self, rng: Generator, objects: Objects, taken: Taken) -> Placements:
        """See `Sampler`."""
        extents = {name: objects[name].extent(self.rest) for name in self.names}
        failed: tuple[str, Extent, dict[str, Placed]] | None = None
        for _ in range(LAYOUTS):
            found: Placements = {}
            for name, extent in extents.items():
                place = self._place(rng, extent, {**taken, **found})
                if place is None:
                    failed = name, extent, {**taken, **found}
                    break
                found[name] = place
            else:
                return found
        assert failed is not None
        raise PlacementError(self._explain(*failed))

    def _place(self, rng: Generator, extent: Extent, taken: Taken) -> Placed | None:
        region, (ox, oy, oz) = self.region, self.origin
        kept = extent.radius if region.inside else 0.0
        x0, x1 = region.x[0] + kept, region.x[1] - kept
        y0, y1 = region.y[0] + kept, region.y[1] - kept
        height = oz + region.clearance + extent.bottom
        w, i, j, k = self.rest
        for _ in range(TRIES if x0 <= x1 and y0 <= y1 else 0):
            position = (ox + rng.uniform(x0, x1), oy + rng.uniform(y0, y1), height)
            half = rng.uniform(*region.yaw) / 2
            c, s = math.cos(half), math.sin(half)
            quat = (c * w - s * k, c * i - s * j, c * j + s * i, c * k + s * w)
            placed = Placed(position=position, quat=quat, extent=extent)
            if not any(placed.touches(o, region.gap) for o in taken.values()):
                return placed
        return None

    def _explain(self, name: str, extent: Extent, taken: Mapping[str, Placed]) -> str:
        region = self.region
        beside = ", ".join(f"{n} ({p.extent.radius:.3f})" for n, p in taken.items())
        inside = ", give it inside = false" if region.inside else ""
        return (
            f"No free place for '{name}' of radius {extent.radius:.3f} m in x "
            f"{region.x[0]:g}..{region.x[1]:g}, y {region.y[0]:g}..{region.y[1]:g} m "
            f"beside {beside or 'nothing'}, with a gap of {region.gap:g} m. Enlarge "
            f"the region, make the gap or the objects smaller{inside}, or place fewer."
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class SequentialSampler:
    """Calls samplers in order; each avoids the objects placed before."""

    samplers: Sequence[Sampler]

    def sample(self, rng: Generator, objects: Objects, taken: Taken) -> Placements:
        """See `Sampler`."""
        found: Placements = {}
        for sampler in self.samplers:
            found |= sampler.sample(rng, objects, {**taken, **found})
        return found


@dataclass(frozen=True, kw_only=True, slots=True)
class OnTopSampler:
    """Draws poses on top of an object, the support, that is placed already.

    The region is relative to the support's origin and does not turn with it.
    """

    names: Sequence[str]
    support: str
    region: Region

    def sample(self, rng: Generator, objects: Objects, taken: Taken) -> Placements:
        """See `Sampler`."""
        below = taken.get(self.support)
        if below is None:
            raise PlacementError(
                f"'{self.support}' must be placed before objects on top of it. "
                f"Placed: {', '.join(taken) or 'nothing'}."
            )
        x, y, z = below.position
        on_top = UniformSampler(
            names=self.names,
            region=self.region,
            origin=(x, y, z + below.extent.top),
        )
        return on_top.sample(rng, objects, taken)


@dataclass(frozen=True, kw_only=True, slots=True)
class RejectionSampler:
    """Calls a sampler until its poses are accepted; `wanted` describes that."""

    sampler: Sampler
    accepts: Callable[[Placements], bool]
    wanted: str

    def sample(self, rng: Generator, objects: Objects, taken: Taken) -> Placements:
        """See `Sampler`."""
        found: Placements = {}
        for _ in range(TRIES):
            found = self.sampler.sample(rng, objects, taken)
            if self.accepts(found):
                return found
        raise PlacementError(
            f"In {TRIES} tries there was no place for {', '.join(found)} where "
            f"{self.wanted}. Change the region, or the sizes of the objects."
        )


SAMPLERS: Registry[Callable[..., Sampler]] = Registry("sampler")
"""Classes of samplers, or functions that make them, by name.

One that is named in `make(placement_initializer=...)` is called without arguments, one
in a table by the table's other keys.
"""

register_sampler = SAMPLERS.register
register_sampler("uniform", UniformSampler)
register_sampler("sequential", SequentialSampler)
register_sampler("on_top", OnTopSampler)


def make_sampler(given: Sampler | str | Mapping[str, Any]) -> Sampler:
    """Return a sampler from its name, `module:Name`, or table; a sampler as it is.

    A table has the name as `type`, such as `{"type": "uniform", "names": ["cube"],
    "region": {"x": [-0.1, 0.1], "y": [0, 0]}, "origin": [0, 0, 0.8]}`. A `region` is a
    table of `Region`, and `samplers` are tables.

    Raises:
        UnknownNameError: If there is no sampler of this name.
        ConfigError: If a key or a value is wrong.
    """
    if isinstance(given, str):
        return SAMPLERS.find(given)()
    if not isinstance(given, Mapping):
        return given
    options = dict(given)
    make = SAMPLERS[options.pop("type", None)]
    if "region" in options:
        region = options["region"]
        options["region"] = parse_model(
            Region, region, source="sampler", within="region"
        )
    if isinstance(parts := options.get("samplers"), list | tuple):
        options["samplers"] = [make_sampler(part) for part in parts]
    try:
        return make(**options)
    except TypeError as error:
        raise ConfigError(f"sampler '{given['type']}': {error}.") from error
