"""Objects of one shape: boxes, balls, cylinders and capsules."""

import xml.etree.ElementTree as ET
from dataclasses import replace
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.models.objects.bodies import (
    MujocoGeneratedObject,
    joints_of,
)
from wbc_suite.compat.robosuite.utils.mjcf_utils import Element, get_size, new_geom
from wbc_suite.errors import ConfigError
from wbc_suite.scene.objects import Extent
from wbc_suite.typing import Vector

SMALL, LARGE = 0.07, 0.07
DENSITY = 1000.0
FRICTION = (1.0, 0.005, 0.0001)
CONTACT = ("density", "friction", "solref", "solimp")


class PrimitiveObject(MujocoGeneratedObject):
    """One geom; sizes in m, drawn between `size_min` and `size_max` without `size`.

    Attributes:
        size: Half edges of a box; radius of a ball; radius and half height else.
    """

    kind = "box"
    count = 3

    def __init__(
        self,
        name: str,
        size: Any = None,
        size_max: Any = None,
        size_min: Any = None,
        density: float | None = None,
        friction: Any = None,
        rgba: Any = None,
        solref: Any = None,
        solimp: Any = None,
        material: Any = None,
        joints: Any = "default",
        obj_type: str = "all",
        duplicate_collision_geoms: bool = True,
        rng: np.random.Generator | None = None,
    ) -> None:
        super().__init__(obj_type, duplicate_collision_geoms)
        self._name, n = name, self.count
        self.size = get_size(size, size_max, size_min, [LARGE] * n, [SMALL] * n, rng)
        self.density = DENSITY if density is None else density
        self.friction = FRICTION if friction is None else friction
        self.rgba = (0.5, 0.5, 0.5, 1) if rgba is None else rgba
        self.solref = (0.02, 1.0) if solref is None else solref
        self.solimp = (0.9, 0.95, 0.001) if solimp is None else solimp
        self.joint_specs = joints_of(joints)
        self.sanity_check()
        self.material = None
        if material is not None:
            self.append_material(material)
        self._get_object_properties()

    def sanity_check(self) -> None:
        """Raise ConfigError if a size is missing or not positive."""
        if len(self.size) != self.count or min(self.size) <= 0.0:
            raise ConfigError(f"A {self.kind} has {self.count} positive sizes in m.")

    def _get_object_subtree(self) -> Element:
        body = ET.Element("body")
        values = {key: getattr(self, key) for key in CONTACT}
        if self.material is None:
            values["rgba"] = self.rgba
        else:
            values["material"] = self.material.name
        body.append(new_geom("g0", self.kind, self.size, condim=4, **values))
        return body

    def _extent(self) -> Extent:
        half = sum(self.size) if self.kind == "capsule" else self.size[-1]
        return Extent(radius=self.size[0], bottom=half, top=half)


class BoxObject(PrimitiveObject):
    """A box."""

    def _extent(self) -> Extent:
        return replace(
            super()._extent(), radius=float(np.hypot(self.size[0], self.size[1]))
        )

    def get_bounding_box_half_size(self) -> Vector:
        """Return half its edges, m."""
        return np.array(self.size)


class BallObject(PrimitiveObject):
    """A ball."""

    kind, count = "sphere", 1


class CylinderObject(PrimitiveObject):
    """An upright cylinder."""

    kind, count = "cylinder", 2


class CapsuleObject(PrimitiveObject):
    """An upright capsule."""

    kind, count = "capsule", 2
