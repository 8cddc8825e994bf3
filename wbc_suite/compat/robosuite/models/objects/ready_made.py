"""Objects of robosuite's tasks by its class names; their bodies are ours."""

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from wbc_suite.compat.robosuite.models.objects.bodies import MujocoXMLObject
from wbc_suite.compat.robosuite.utils.mjcf_utils import array_to_string
from wbc_suite.envs.states import write_scene
from wbc_suite.errors import ConfigError
from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene import objects as ours
from wbc_suite.scene.objects import Extent, ObjectState, SceneObject

OURS = "object"
"""Name of the body in the text of an object."""

LOOKS = ("rgba", "texture", "transparent", "material")
"""Parts of names of arguments that only say how an object is drawn; no effect."""


class ReadyMade(MujocoXMLObject):
    """One of our objects; `density` and `friction` hold for all of its parts."""

    make: Callable[..., SceneObject]
    joints_by_default: Any = "default"
    obj_type_by_default = "all"

    def __init__(self, name: str, joints: Any = None, **arguments: Any) -> None:
        obj_type = arguments.pop("obj_type", self.obj_type_by_default)
        physics = {k: arguments.pop(k, None) for k in ("density", "friction")}
        own = {k: v for k, v in arguments.items() if not any(w in k for w in LOOKS)}
        try:
            made = type(self).make(OURS, **own)
        except TypeError as error:
            raise ConfigError(
                f"{type(self).__name__}: unsupported arguments among {', '.join(own)}."
            ) from error
        self._made = replace(made, motion="fixed")
        joints = self.joints_by_default if joints is None else joints
        super().__init__(_text(self._made, **physics), name, joints, obj_type)

    @cached_property
    def _measured(self) -> Extent:
        model = self._made.compiled_alone()
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        return ObjectState(model, data, self._made.name).extent()

    @property
    def important_sites(self) -> dict[str, str]:
        """Names of its sites by role; `obj` is its origin."""
        own = {role: f"{self.naming_prefix}{role}" for role in self._made.sites}
        return super().important_sites | own


def _text(made: SceneObject, *, density: Any, friction: Any) -> str:
    """Return an object as MJCF; names of parts are those of the class to give."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    made.add_to(spec)
    root = ET.fromstring(write_scene(spec))
    for element in root.iter():
        for key in ("name", "mesh", "material", "texture"):
            value = element.get(key, "")
            if value.startswith(f"{OURS}_"):
                element.set(key, value.removeprefix(f"{OURS}_"))
    for geom in root.iter("geom"):
        geom.attrib.pop("name", None)
        if density is not None and geom.get("contype", "1") != "0":
            geom.set("density", str(density))
        if friction is not None:
            geom.set("friction", array_to_string(np.atleast_1d(friction)))
    return ET.tostring(root, encoding="unicode")


def _hammer(
    name: str,
    handle_shape: str = "box",
    handle_radius: Any = (0.015, 0.02),
    handle_length: Any = (0.1, 0.25),
    rng: np.random.Generator | None = None,
) -> SceneObject:
    """Draw the sizes of a hammer; its handle is round, whatever the shape is."""
    draw = (rng or np.random.default_rng()).uniform
    radius, length = (
        float(draw(*np.broadcast_to(size, 2)))
        for size in (handle_radius, handle_length)
    )
    return ours.hammer(name, handle_radius=radius, handle_length=length)


def _three(given: Any) -> Vector3:
    x, y, z = (float(value) for value in np.broadcast_to(given, 3))
    return x, y, z


def _pot(
    name: str,
    body_half_size: Any = (0.07, 0.07, 0.07),
    thickness: float = 0.01,
    **kw: Any,
) -> SceneObject:
    return ours.pot(name, half_size=_three(body_half_size), wall=thickness, **kw)


def _bin(
    name: str, bin_size: Any = (0.3, 0.3, 0.15), wall_thickness: float = 0.01
) -> SceneObject:
    return ours.open_bin(name, _three(bin_size), wall=wall_thickness)


def _lid(name: str, lid_size: Any = (0.3, 0.3, 0.01)) -> SceneObject:
    return ours.lid(name, _three(lid_size))


def _tube(
    name: str,
    outer_radius: float = 0.0425,
    inner_radius: float = 0.03,
    height: float = 0.05,
    ngeoms: int = 8,
) -> SceneObject:
    return ours.hollow_cylinder(
        name, inner_radius, outer_radius, height / 2, sides=ngeoms
    )


def _door(name: str, lock: bool = False) -> SceneObject:
    return ours.door(name, latch=lock)


_MADE: dict[str, Callable[..., SceneObject]] = {
    "BottleObject": ours.bottle,
    "CanObject": ours.can,
    "LemonObject": ours.lemon,
    "MilkObject": ours.milk,
    "BreadObject": ours.bread,
    "CerealObject": ours.cereal,
    "SquareNutObject": ours.square_nut,
    "RoundNutObject": ours.round_nut,
    "PlateWithHoleObject": ours.plate_with_hole,
    "DoorObject": _door,
    "HammerObject": _hammer,
    "PotWithHandlesObject": _pot,
    "Bin": _bin,
    "Lid": _lid,
    "HollowCylinderObject": _tube,
    "StandWithMount": ours.stand,
    "HookFrame": ours.hanging_frame,
}
"""Our functions by robosuite's class names."""

_FIXED = ("DoorObject", "StandWithMount", "PlateWithHoleObject")
_VISUAL = ("Milk", "Bread", "Cereal", "Can")


def _class(name: str, make: Callable[..., SceneObject], **body: Any) -> type[ReadyMade]:
    body |= {
        "make": staticmethod(make),
        "__module__": __name__,
        "__doc__": make.__doc__,
    }
    return type(name, (ReadyMade,), body)


READY_MADE = {
    name: _class(name, make, **({"joints_by_default": []} if name in _FIXED else {}))
    for name, make in _MADE.items()
} | {
    f"{kind}VisualObject": _class(
        f"{kind}VisualObject",
        _MADE[f"{kind}Object"],
        joints_by_default=[],
        obj_type_by_default="visual",
    )
    for kind in _VISUAL
}
"""Classes of objects by name."""
globals().update(READY_MADE)
