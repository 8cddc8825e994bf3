"""Samplers of start poses of objects, apart by their upright bounding cylinders."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.models.objects.bodies import TaskObject
from wbc_suite.compat.robosuite.utils.transform_utils import quat_multiply
from wbc_suite.errors import ConfigError, PlacementError
from wbc_suite.scene.placement import Objects, Placed, Placements, Taken

TRIES = 5000


class SamplerOfTask:
    """A sampler of robosuite's for the objects of one of our tasks."""

    def __init__(self, sampler: "ObjectPositionSampler") -> None:
        self.sampler = sampler

    def sample(
        self, rng: np.random.Generator, objects: Objects, taken: Taken
    ) -> Placements:
        """Return a pose of each object; see `wbc_suite.scene.placement`.

        Of a composite, the sampler `{object}Sampler` places the object, as robosuite's.
        """
        sampler = self.sampler
        sampler.reset()
        own = [TaskObject(state) for state in objects.values()]
        parts = getattr(sampler, "samplers", None)
        if parts is None:
            sampler.add_objects(own)
        for name, part in (parts or {}).items():
            part.add_objects([item for item in own if name == f"{item.name}Sampler"])
        for part in (sampler, *(parts or {}).values()):
            part.rng = rng
        return {
            name: Placed(
                position=(float(x), float(y), float(z)),
                quat=(float(w), float(i), float(j), float(k)),
                extent=objects[name].extent(),
            )
            for name, ((x, y, z), (w, i, j, k), _) in sampler.sample().items()
        }


class ObjectPositionSampler:
    """Draws a pose for each of its objects; see `sample`."""

    def __init__(
        self,
        name: str,
        mujoco_objects: Any = None,
        ensure_object_boundary_in_range: bool = True,
        ensure_valid_placement: bool = True,
        reference_pos: Any = (0, 0, 0),
        z_offset: float = 0.0,
        rng: np.random.Generator | None = None,
    ) -> None:
        self.name, self.z_offset = name, z_offset
        self.ensure_object_boundary_in_range = ensure_object_boundary_in_range
        self.ensure_valid_placement = ensure_valid_placement
        self.reference_pos = reference_pos
        self.rng = np.random.default_rng() if rng is None else rng
        self.mujoco_objects: list[Any] = []
        if mujoco_objects is not None:
            self.add_objects(mujoco_objects)

    def add_objects(self, mujoco_objects: Any) -> None:
        """Add objects."""
        several = isinstance(mujoco_objects, list | tuple)
        for item in mujoco_objects if several else [mujoco_objects]:
            if item in self.mujoco_objects:
                raise ConfigError(f"{self.name}: '{item.name}' is sampled already.")
            self.mujoco_objects.append(item)

    def reset(self) -> None:
        """Forget the objects."""
        self.mujoco_objects = []

    def sample(
        self,
        fixtures: Mapping[str, Any] | None = None,
        reference: Any = None,
        on_top: bool = True,
    ) -> dict[str, Any]:
        """Return position (m), quaternion (w x y z) and object by name.

        `fixtures` are placed already. `reference` is a position, or the name of an
        object that is placed.

        Raises:
            PlacementError: If no free place is found.
        """
        raise NotImplementedError


class UniformRandomSampler(ObjectPositionSampler):
    """Draws poses uniformly in a rectangle.

    `rotation` is an angle about `rotation_axis`, rad, a range of angles, or None for
    any. Further arguments are those of `ObjectPositionSampler`.
    """

    def __init__(
        self,
        name: str,
        mujoco_objects: Any = None,
        x_range: Any = (0, 0),
        y_range: Any = (0, 0),
        rotation: Any = None,
        rotation_axis: str = "z",
        *shared: Any,
        **named: Any,
    ) -> None:
        if rotation_axis not in ("x", "y", "z"):
            raise ConfigError("rotation_axis is 'x', 'y' or 'z'.")
        self.x_range, self.y_range = x_range, y_range
        self.rotation, self.rotation_axis = rotation, rotation_axis
        super().__init__(name, mujoco_objects, *shared, **named)

    def _within(self, limits: Any, radius: float) -> float:
        low, high = limits
        kept = radius if self.ensure_object_boundary_in_range else 0.0
        if low + kept > high - kept:
            raise PlacementError(
                f"{self.name}: {low:g}..{high:g} m is too narrow for a radius of "
                f"{radius:.3f} m. Widen it, or let objects reach out of it."
            )
        return float(self.rng.uniform(low + kept, high - kept))

    def _sample_x(self, object_horizontal_radius: float) -> float:
        return self._within(self.x_range, object_horizontal_radius)

    def _sample_y(self, object_horizontal_radius: float) -> float:
        return self._within(self.y_range, object_horizontal_radius)

    def _sample_quat(self) -> Any:
        given = self.rotation
        if given is None:
            angle = self.rng.uniform(0.0, 2.0 * math.pi)
        elif isinstance(given, int | float):
            angle = float(given)
        else:
            angle = self.rng.uniform(min(given), max(given))
        quat = np.zeros(4)
        quat[0] = math.cos(angle / 2)
        quat["xyz".index(self.rotation_axis) + 1] = math.sin(angle / 2)
        return quat

    def sample(
        self,
        fixtures: Mapping[str, Any] | None = None,
        reference: Any = None,
        on_top: bool = True,
    ) -> dict[str, Any]:
        """See `ObjectPositionSampler.sample`."""
        placed = dict(fixtures or {})
        base = self._base(reference, placed, on_top)
        for item in self.mujoco_objects:
            if item.name in placed:
                raise ConfigError(f"{self.name}: '{item.name}' is placed already.")
            placed[item.name] = self._place(item, base, placed, on_top)
        return placed

    def _base(self, reference: Any, placed: Mapping[str, Any], on_top: bool) -> Any:
        if not isinstance(reference, str):
            given = self.reference_pos if reference is None else reference
            return np.asarray(given, np.float64)
        if reference not in placed:
            raise ConfigError(f"{self.name}: '{reference}' is not placed yet.")
        position, _, item = placed[reference]
        above = np.array([0, 0, item.top_offset[-1]]) if on_top else np.zeros(3)
        return np.asarray(position) + above

    def _place(
        self, item: Any, base: Any, placed: Mapping[str, Any], on_top: bool
    ) -> Any:
        radius, bottom = item.horizontal_radius, item.bottom_offset[-1]
        for _ in range(TRIES):
            x = base[0] + self._sample_x(radius)
            y = base[1] + self._sample_y(radius)
            z = base[2] + self.z_offset - (bottom if on_top else 0.0)
            if self.ensure_valid_placement and self._is_taken((x, y, z), item, placed):
                continue
            quat = self._sample_quat()
            if hasattr(item, "init_quat"):  # w x y z, as the quaternion
                first, then = np.roll(item.init_quat, -1), np.roll(quat, -1)
                quat = np.roll(quat_multiply(then, first), 1)
            return (x, y, z), quat, item
        raise PlacementError(
            f"{self.name}: no free place for '{item.name}'. Enlarge the ranges."
        )

    def _is_taken(self, place: Any, item: Any, placed: Mapping[str, Any]) -> bool:
        x, y, z = place
        for (ox, oy, oz), _, other in placed.values():
            beside = other.horizontal_radius + item.horizontal_radius
            above = other.top_offset[-1] - item.bottom_offset[-1]
            if math.hypot(x - ox, y - oy) <= beside and z - oz <= above:
                return True
        return False


class SequentialCompositeSampler(ObjectPositionSampler):
    """Calls samplers in order; each avoids the objects placed before."""

    def __init__(self, name: str) -> None:
        self.samplers: dict[str, ObjectPositionSampler] = {}
        self.sample_args: dict[str, Any] = {}
        super().__init__(name)

    def append_sampler(
        self, sampler: ObjectPositionSampler, sample_args: Any = None
    ) -> None:
        """Add a sampler, with arguments of its `sample`."""
        self.samplers[sampler.name] = sampler
        self.sample_args[sampler.name] = sample_args or {}

    def hide(self, mujoco_objects: Any) -> None:
        """Place objects far away."""
        far = dict.fromkeys(("x_range", "y_range"), (-10, -20))
        self.append_sampler(
            UniformRandomSampler(
                f"hide{len(self.samplers)}",
                mujoco_objects,
                **far,
                rotation=(0, 0),
                ensure_object_boundary_in_range=False,
                ensure_valid_placement=False,
                z_offset=10,
            )
        )

    def add_objects(self, mujoco_objects: Any) -> None:
        """Raise ConfigError: objects belong to the samplers."""
        raise ConfigError("Use add_objects_to_sampler: objects belong to a sampler.")

    def add_objects_to_sampler(self, sampler_name: str, mujoco_objects: Any) -> None:
        """Add objects to one of the samplers."""
        self.samplers[sampler_name].add_objects(mujoco_objects)

    def reset(self) -> None:
        """Forget the objects of all samplers."""
        for sampler in self.samplers.values():
            sampler.reset()

    def sample(
        self,
        fixtures: Mapping[str, Any] | None = None,
        reference: Any = None,
        on_top: bool = True,
    ) -> dict[str, Any]:
        """See `ObjectPositionSampler.sample`."""
        placed = dict(fixtures or {})
        for name, sampler in self.samplers.items():
            given = {"reference": reference, "on_top": on_top, **self.sample_args[name]}
            placed |= sampler.sample(fixtures=placed, **given)
        return placed
