"""Objects that users compose: of geoms, of other objects, and groups of objects."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.models.objects.bodies import (
    MujocoGeneratedObject,
    MujocoObject,
    joints_of,
)
from wbc_suite.compat.robosuite.models.objects.shapes import FRICTION
from wbc_suite.compat.robosuite.utils.mjcf_utils import (
    Element,
    array_to_string,
    new_body,
    new_geom,
    new_joint,
    new_site,
)
from wbc_suite.errors import ConfigError
from wbc_suite.scene.objects import Extent
from wbc_suite.typing import Vector


def _half_edges(kind: str, size: Sequence[float]) -> Vector:
    """Return half the edges of the box around a geom, m."""
    if kind in ("box", "ellipsoid"):
        return np.asarray(size, np.float64)
    height = {"sphere": size[0], "capsule": sum(size[:2]), "cylinder": size[-1]}
    if kind not in height:
        raise ConfigError(f"'{kind}' is none of: box, ellipsoid, {', '.join(height)}.")
    return np.array([size[0], size[0], height[kind]])


class CompositeObject(MujocoGeneratedObject):
    """Geoms in a box with half edges `total_size`, m.

    `geom_locations` say where each geom's bounding box begins, from the box's corner,
    or, with `locations_relative_to_center`, where its middle is, from the box's.
    Values of geoms are lists of their number, or one for all.
    """

    def __init__(
        self,
        name: str,
        total_size: Any,
        geom_types: Sequence[str],
        geom_sizes: Sequence[Any],
        geom_locations: Sequence[Any],
        geom_quats: Sequence[Any] | None = None,
        geom_names: Sequence[str | None] | None = None,
        geom_rgbas: Sequence[Any] | None = None,
        geom_materials: Sequence[str | None] | None = None,
        geom_frictions: Sequence[Any] | None = None,
        geom_condims: Sequence[int | None] | None = None,
        rgba: Any = None,
        density: Any = 100.0,
        solref: Any = (0.02, 1.0),
        solimp: Any = (0.9, 0.95, 0.001),
        locations_relative_to_center: bool = False,
        joints: Any = "default",
        sites: Sequence[Mapping[str, Any]] | None = None,
        obj_types: Any = "all",
        duplicate_collision_geoms: bool = True,
    ) -> None:
        super().__init__("all", duplicate_collision_geoms)
        self._name, count = name, len(geom_types)
        self.total_size = np.array(total_size, np.float64)
        self.joint_specs, self._sites = joints_of(joints), list(sites or ())
        self._kinds = [obj_types] * count if isinstance(obj_types, str) else obj_types
        one_for_all = {"density": density, "solref": solref, "solimp": solimp}
        columns = {
            "quat": geom_quats,
            "name": geom_names,
            "rgba": geom_rgbas or [rgba] * count,
            "material": geom_materials,
            "friction": geom_frictions or [FRICTION] * count,
            "condim": geom_condims,
            **{k: _column(v, k, count) for k, v in one_for_all.items()},
        }
        self._geoms = []
        for k, (kind, size) in enumerate(zip(geom_types, geom_sizes, strict=True)):
            values = {key: column[k] for key, column in columns.items() if column}
            place = np.asarray(geom_locations[k], np.float64)
            if not locations_relative_to_center:
                place = place - self.total_size + _half_edges(kind, size)
            values |= {"type": kind, "size": size, "pos": place}
            values.setdefault("name", None)
            self._geoms.append({x: v for x, v in values.items() if v is not None})
        self._get_object_properties()

    def _get_object_subtree(self) -> Element:
        body = new_body("root")
        for k, (given, kind) in enumerate(zip(self._geoms, self._kinds, strict=True)):
            geom = {"name": f"g{k}", "group": 1 if kind == "visual" else 0, **given}
            body.append(new_geom(**geom))
        for k, site in enumerate(self._sites):
            body.append(new_site(**{"name": f"site{k}", **site}))
        return body

    def get_bounding_box_half_size(self) -> Vector:
        """Return half the edges of its box, m."""
        return self.total_size.copy()

    def in_box(self, position: Any, object_position: Any) -> bool:
        """Whether a point is in its box, or at most 1 cm below it."""
        low = np.asarray(position) - self.total_size - [0.0, 0.0, 0.01]
        high = np.asarray(position) + self.total_size
        place = np.asarray(object_position)
        return bool(np.all(place > low) and np.all(place < high))

    def _extent(self) -> Extent:
        radius, height = float(np.linalg.norm(self.total_size[:2])), self.total_size[2]
        return Extent(radius=radius, bottom=height, top=height)


def _column(value: Any, key: str, count: int) -> list[Any]:
    """Return one value for each geom."""
    single = np.ndim(value) == (0 if key == "density" else 1)
    return [value] * count if value is None or single else list(value)


class CompositeBodyObject(MujocoGeneratedObject):
    """Bodies of other objects on a body without shape, or on one another.

    `object_parents` are names of root bodies, None or `root` for the object's own;
    `body_joints` are joints by those names. Own joints of the objects are left out.
    """

    def __init__(
        self,
        name: str,
        objects: Any,
        object_locations: Sequence[Any],
        object_quats: Sequence[Any] | None = None,
        object_parents: Sequence[str | None] | None = None,
        joints: Any = "default",
        body_joints: Mapping[str, Any] | None = None,
        sites: Sequence[Mapping[str, Any]] | None = None,
        total_size: Any = None,
        locations_relative_to_corner: bool = False,
    ) -> None:
        super().__init__()
        self._name = name
        self.objects = [objects] if isinstance(objects, MujocoObject) else list(objects)
        count = len(self.objects)
        self.joint_specs, self._sites = joints_of(joints), list(sites or ())
        self._body_joints = dict(body_joints or {})
        self.total_size = None if total_size is None else np.array(total_size)
        if locations_relative_to_corner and self.total_size is None:
            raise ConfigError("locations_relative_to_corner needs `total_size`.")
        self._from_corner = locations_relative_to_corner
        self._places = list(object_locations)
        self._quats = list(object_quats or [None] * count)
        self._parents = list(object_parents or [None] * count)
        self._top = self._bottom = self._radius = 0.0
        self._get_object_properties()

    def _get_object_subtree(self) -> Element:
        body = new_body("root")
        bodies, middles = {"root": body}, {"root": np.zeros(3)}
        rows = zip(self.objects, self._places, self._quats, self._parents, strict=True)
        for item, given, quat, named in rows:
            place = np.zeros(3) if given is None else np.asarray(given, np.float64)
            if self._from_corner and self.total_size is not None:
                place = place - self.total_size + item.get_bounding_box_half_size()
            child = item.get_obj()
            for joint in [*child.findall("joint"), *child.findall("freejoint")]:
                child.remove(joint)
            child.set("pos", array_to_string(place))
            if quat is not None:
                child.set("quat", array_to_string(quat))
            parent = named or "root"
            if parent not in bodies:
                raise ConfigError(f"object_parents: '{parent}' is none of {[*bodies]}.")
            bodies[parent].append(child)
            self.merge_assets(item)
            middle = middles[parent] + place
            bodies[item.root_body], middles[item.root_body] = child, middle
            self._top = max(self._top, middle[2] + item.top_offset[2])
            self._bottom = min(self._bottom, middle[2] + item.bottom_offset[2])
            reach = float(np.abs(middle[:2]).max()) + item.horizontal_radius
            self._radius = max(self._radius, reach)
        for name, joints in self._body_joints.items():
            for k, joint in enumerate(joints_of(joints)):
                given = {"name": f"{name}_joint{k}", **joint}
                bodies[name or "root"].insert(0, new_joint(**given))
        for k, site in enumerate(self._sites):
            body.append(new_site(**{"name": f"site{k}", **site}))
        return body

    def get_bounding_box_half_size(self) -> Vector:
        """Return half the edges of its box, m."""
        if self.total_size is not None:
            return self.total_size.copy()
        return super().get_bounding_box_half_size()

    def _extent(self) -> Extent:
        return Extent(radius=self._radius, bottom=-self._bottom, top=self._top)


class ObjectGroup:
    """Objects that belong together; a subclass makes them and tells their states.

    Attributes:
        sim: The simulation they are in, after `update_sim`.
    """

    def __init__(self, name: str) -> None:
        self.name, self.sim = name, None
        self._objects: dict[str, MujocoObject] = {}
        self._generate_objects()

    def _generate_objects(self) -> None:
        raise NotImplementedError

    def get_states(self) -> dict[str, Any]:
        """Return the states of the group by name."""
        raise NotImplementedError

    def update_sim(self, sim: Any) -> None:
        """Take the simulation that the objects are in."""
        self.sim = sim

    @property
    def objects(self) -> dict[str, MujocoObject]:
        """Objects by name."""
        return self._objects
