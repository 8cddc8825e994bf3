"""Objects as trees of elements: those of MJCF files, and those that code makes."""

import copy
import xml.etree.ElementTree as ET
from functools import cached_property
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.models.base import (
    MujocoModel,
    MujocoXML,
    element_names,
)
from wbc_suite.compat.robosuite.utils.mjcf_utils import (
    OBJECT_COLLISION_COLOR,
    Element,
    add_prefix,
    array_to_string,
    new_joint,
    new_site,
    string_to_array,
)
from wbc_suite.errors import ConfigError
from wbc_suite.scene.objects import Extent, ObjectState
from wbc_suite.typing import Vector

FREE = {"type": "free", "damping": "0.0005"}


def joints_of(given: Any) -> list[dict[str, Any]]:
    """Return the attributes of joints: "default" is a free one, None is none."""
    return [dict(FREE)] if isinstance(given, str) else [dict(j) for j in given or ()]


def _names(doc: str, *tags: str, solid: bool | None = None) -> Any:
    """Return a property: names of elements, perhaps of solid or visual geoms only."""

    def names(self: "MujocoObject") -> list[str]:
        every = (element for tag in tags for element in self._obj.iter(tag))
        return element_names(
            e for e in every if solid in (None, e.get("contype", "1") != "0")
        )

    return property(names, doc=doc)


class MujocoObject(MujocoModel):
    """A body with joints, sites and geoms; names in the scene start with its own.

    A subclass sets `_name` and returns its body in `_get_object_subtree`; then it calls
    `_get_object_properties`. Its root body is `{name}_main`, joints without a name are
    `{name}_joint0`, ..., geoms `{name}_g0`, ...; its middle is `{name}_default_site`.
    Geoms of group 1 are visual; where there are none, collision geoms are drawn.
    """

    joint_specs: list[dict[str, Any]]

    def __init__(
        self,
        obj_type: str = "all",
        duplicate_collision_geoms: bool = True,
        scale: Any = None,
    ) -> None:
        if obj_type not in ("collision", "visual", "all"):
            raise ConfigError("obj_type is 'collision', 'visual' or 'all'.")
        if scale is not None:
            raise ConfigError(
                "scale: give the geoms their sizes, it has no effect here."
            )
        self.obj_type = obj_type
        self.duplicate_collision_geoms = duplicate_collision_geoms
        self.asset = ET.Element("asset")

    def _get_object_subtree(self) -> Element:
        raise NotImplementedError

    def _get_object_properties(self) -> None:
        """Complete the body: names, joints, a site, and the prefix."""
        self._obj = self._get_object_subtree()
        self._obj.set("name", "main")
        for geom in list(self._obj.iter("geom")):
            self._finish_geom(geom)
        for k, spec in enumerate(self.joint_specs):
            given = {"name": f"joint{k}", **spec}
            self._obj.append(new_joint(**given))
        self._obj.append(new_site("default_site", size=(0.002,), rgba=(1, 0, 0, 0)))
        for prefixed in (self._obj, self.asset):
            add_prefix(prefixed, self.naming_prefix, self.exclude_from_prefixing)

    def _finish_geom(self, geom: Element) -> None:
        """Name a geom, and add the visual of a collision geom, or make it one."""
        count = len([g for g in self._obj.iter("geom") if g.get("name")])
        if not geom.get("name"):
            geom.set("name", f"g{count}")
        visual = geom.get("group", "0") == "1"
        if visual:
            geom.attrib |= {"contype": "0", "conaffinity": "0", "mass": "0"}
            geom.attrib.pop("density", None)
        elif self.obj_type == "visual":
            geom.attrib |= {"group": "1", "contype": "0", "conaffinity": "0"}
        elif not self.duplicate_collision_geoms and not geom.get("rgba"):
            geom.set("rgba", array_to_string(OBJECT_COLLISION_COLOR))

    def get_obj(self) -> Element:
        """Return a copy of the body."""
        return copy.deepcopy(self._obj)

    def merge_assets(self, other: Any) -> None:
        """Add the assets of another model."""
        self.asset.extend(list(other.asset))

    bodies: Any = _names("Names of its bodies.", "body")
    joints: Any = _names("Names of its joints.", "joint", "freejoint")
    sites: Any = _names("Names of its sites.", "site")
    contact_geoms: Any = _names("Names of the geoms that collide.", "geom", solid=True)
    visual_geoms: Any = _names(
        "Names of the geoms that are drawn only.", "geom", solid=False
    )
    root_body: Any = property(lambda self: f"{self.name}_main", doc="Name of its body.")

    @property
    def important_sites(self) -> dict[str, str]:
        """The site at its origin, `obj`."""
        return {"obj": f"{self.naming_prefix}default_site"}

    actuators: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()

    @staticmethod
    def get_site_attrib_template() -> dict[str, str]:
        """Return attributes of an invisible site."""
        return {"pos": "0 0 0", "size": "0.002", "rgba": "1 0 0 0", "type": "sphere"}

    @staticmethod
    def get_joint_attrib_template() -> dict[str, str]:
        """Return attributes of a free joint."""
        return {"type": "free"}

    def get_bounding_box_half_size(self) -> Vector:
        """Return half the edges of its bounding box, m."""
        radius = self.horizontal_radius
        return np.array([radius, radius, self.top_offset[2]])

    def get_bounding_box_size(self) -> Vector:
        """Return the edges of its bounding box, m."""
        return 2.0 * self.get_bounding_box_half_size()


class MujocoXMLObject(MujocoObject, MujocoXML):  # pyright: ignore[reportIncompatibleMethodOverride] - the constructor names it
    """The body named `object` of an MJCF file, or else the first body of its world.

    Sites beside it, `bottom_site`, `top_site`, `horizontal_radius_site`, say how far it
    extends; without them its extent is that of its bounding box.
    """

    def __init__(
        self,
        fname: str,
        name: str,
        joints: Any = "default",
        obj_type: str = "all",
        duplicate_collision_geoms: bool = True,
        scale: Any = None,
    ) -> None:
        MujocoXML.__init__(self, fname)
        asset = self.asset
        MujocoObject.__init__(self, obj_type, duplicate_collision_geoms, scale)
        self.asset, self._name, self.joint_specs = asset, name, joints_of(joints)
        self._get_object_properties()

    def _get_object_subtree(self) -> Element:
        bodies = list(self.worldbody.iter("body"))
        if not bodies:
            raise ConfigError(f"{self.file}: there is no body in it.")
        own = next((b for b in bodies if b.get("name") == "object"), bodies[0])
        outer = next((b for b in bodies if own in list(b)), own)
        self._extents = {
            site.get("name"): string_to_array(site.get("pos", "0 0 0"))
            for site in outer.iter("site")
        }
        for joint in [*own.findall("joint"), *own.findall("freejoint")]:
            if self.joint_specs:
                own.remove(joint)
        return own

    @property
    def bottom_offset(self) -> Vector:  # pyright: ignore[reportIncompatibleVariableOverride] - read from the file
        """Offset of its lowest point from its origin, m."""
        site = self._extents.get("bottom_site")
        return super().bottom_offset if site is None else site

    @property
    def top_offset(self) -> Vector:  # pyright: ignore[reportIncompatibleVariableOverride] - read from the file
        """Offset of its highest point from its origin, m."""
        site = self._extents.get("top_site")
        return super().top_offset if site is None else site

    def _extent(self) -> Extent:
        return self._measured

    @cached_property
    def _measured(self) -> Extent:
        half, sites = self._half(), self._extents
        radius = sites.get("horizontal_radius_site", half)
        return Extent(
            radius=float(np.hypot(*radius[:2])),
            bottom=-float(sites.get("bottom_site", -half)[2]),
            top=float(sites.get("top_site", half)[2]),
        )

    def _half(self) -> Vector:
        """Return half the edges of the box around its geoms, from its origin, m."""
        world = ET.Element("mujoco")
        world.append(copy.deepcopy(self.asset))
        ET.SubElement(world, "worldbody").append(self.get_obj())
        model = MujocoXML(ET.tostring(world, encoding="unicode")).get_model()
        middle, half = np.split(model.geom_aabb, 2, axis=1)
        reach = np.abs(middle) + half if model.ngeom else np.zeros((1, 3))
        return (np.abs(model.geom_pos) + reach).max(axis=0)

    def set_pos(self, pos: Any) -> None:
        """Write its position in the scene, m."""
        self._obj.set("pos", array_to_string(pos))

    def set_euler(self, euler: Any) -> None:
        """Write its orientation in the scene, rad."""
        self._obj.set("euler", array_to_string(euler))


class MujocoGeneratedObject(MujocoObject):
    """An object whose body code makes: `_get_object_subtree` returns it.

    A subclass with a property for a value of another class may set it too: a
    `joint_specs`, `density`, `friction`.
    """

    def __init__(
        self, obj_type: str = "all", duplicate_collision_geoms: bool = True
    ) -> None:
        super().__init__(obj_type, duplicate_collision_geoms)
        if not hasattr(self, "joint_specs"):
            self.joint_specs = [dict(FREE)]

    def sanity_check(self) -> None:
        """Raise if sizes are wrong; by default nothing is checked."""

    @staticmethod
    def get_collision_attrib_template() -> dict[str, str]:
        """Return attributes of a collision geom."""
        return {"group": "0", "rgba": array_to_string(OBJECT_COLLISION_COLOR)}

    @staticmethod
    def get_visual_attrib_template() -> dict[str, str]:
        """Return attributes of a visual geom."""
        return {"conaffinity": "0", "contype": "0", "mass": "0", "group": "1"}

    def append_material(self, material: Any) -> None:
        """Add a `CustomMaterial` to the assets."""
        if material.tex_attrib is not None:
            self.asset.append(ET.Element("texture", material.tex_attrib))
        self.asset.append(ET.Element("material", material.mat_attrib))
        self.material = material


class TaskObject(MujocoModel):
    """An object in a scene of ours; its names are those of the scene."""

    def __init__(self, state: ObjectState) -> None:
        self._state, self._name = state, state.name

    @property
    def root_body(self) -> str:
        """Name of its body, robosuite's."""
        return f"{self.name}_main"

    @property
    def joints(self) -> list[str]:
        """Names of its joints, robosuite's."""
        count = int(self._state.model.body_jntnum[self._state.body])
        return [f"{self.name}_joint{k}" for k in range(count)]

    @property
    def contact_geoms(self) -> list[str]:
        """Names of its geoms that collide."""
        return [self._state.model.geom(g).name for g in sorted(self._state.geoms)]

    def _extent(self) -> Extent:
        return self._state.extent()

    @property
    def sites(self) -> list[str]:
        """Names of its sites."""
        model = self._state.model
        return [
            model.site(i).name
            for i in range(model.nsite)
            if model.site_bodyid[i] == self._state.body
        ]
