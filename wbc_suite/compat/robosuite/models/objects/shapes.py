"""Objects of one shape: boxes, balls, cylinders and capsules."""

import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.models.objects.bodies import (
    FREE,
    MujocoGeneratedObject,
)
from wbc_suite.compat.robosuite.utils.mjcf_utils import Element, get_size, new_geom
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

SMALL, LARGE = 0.07, 0.07
DENSITY = 1000.0
FRICTION = (1.0, 0.005, 0.0001)


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
        self.joint_specs = [dict(FREE)] if joints == "default" else list(joints or ())
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
        looks: dict[str, Any] = (
            {"rgba": self.rgba}
            if self.material is None
            else {"material": self.material.name}
        )
        body.append(
            new_geom(
                "g0",
                self.kind,
                self.size,
                density=self.density,
                friction=self.friction,
                solref=self.solref,
                solimp=self.solimp,
                condim=4,
                **looks,
            )
        )
        return body

    @property
    def half_height(self) -> float:
        """Half its height, m."""
        return self.size[-1]

    @property
    def bottom_offset(self) -> Vector:  # pyright: ignore[reportIncompatibleVariableOverride] - of its size
        """Offset of its lowest point from its middle, m."""
        return np.array([0.0, 0.0, -self.half_height])

    @property
    def top_offset(self) -> Vector:  # pyright: ignore[reportIncompatibleVariableOverride] - of its size
        """Offset of its highest point from its middle, m."""
        return np.array([0.0, 0.0, self.half_height])

    @property
    def horizontal_radius(self) -> float:  # pyright: ignore[reportIncompatibleVariableOverride] - of its size
        """Radius of its upright bounding cylinder, m."""
        return self.size[0]


class BoxObject(PrimitiveObject):
    """A box."""

    @property
    def horizontal_radius(self) -> float:  # pyright: ignore[reportIncompatibleVariableOverride] - of its size
        """Half the diagonal of its base, m."""
        return float(np.hypot(self.size[0], self.size[1]))

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

    @property
    def half_height(self) -> float:
        """Half its height with both caps, m."""
        return self.size[0] + self.size[1]
