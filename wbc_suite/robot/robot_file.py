"""Robot files (TOML): components, assemblies of components, and their JSON Schema.

`docs/robots.md` is the reference of all keys.
"""

from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from wbc_suite.errors import ConfigError, DescriptionError, UnknownNameError
from wbc_suite.files import read_text
from wbc_suite.robot.elements import (
    Camera,
    Contacts,
    Elements,
    Frame,
    Link,
    Name,
    Root,
    Sensor,
    Synergy,
)
from wbc_suite.robot.mirror import Mirror, reflect_component
from wbc_suite.robot.shapes import Posed, as_table
from wbc_suite.tomlfile import FrozenModel, parse_model, parse_toml


class Header(FrozenModel):
    """Name, kind (folder in the catalogue) and sources of a component."""

    name: Name
    kind: Literal["arm", "body", "gripper", "base"]
    side: Literal["left", "right"] | None = None
    extends: Name | None = None
    title: str = ""
    source: str = ""
    license: str = ""
    deviations: tuple[str, ...] = ()


SOURCES = ("name", "title", "source", "license", "deviations")
"""Fields of a component's header that its robot has as well."""


class Component(Elements):
    """One component file, such as `robots/arm/panda.toml`."""

    format: Literal[1]
    component: Header
    links: tuple[Link, ...] = Field(alias="link", max_length=500)
    synergies: tuple[Synergy, ...] = Field(default=(), alias="synergy")
    mirror: Mirror | None = None


class Part(Posed):
    """One component of an assembly.

    If `rename` is absent, links and joints get the prefix of the side when two parts
    have the same component.
    """

    name: Name
    component: str
    on: str | None = None
    side: Name | None = None
    rename: bool | None = None
    choice: Literal["gripper", "base"] | None = None


class AssemblyHeader(FrozenModel):
    """Name of the whole robot."""

    name: Name
    title: str = ""
    extends: str | None = None
    deviations: tuple[str, ...] = ()


class Assembly(FrozenModel):
    """One assembly file, such as `robots/panda.toml`; it overrides its parts."""

    format: Literal[1]
    assembly: AssemblyHeader
    parts: tuple[Part, ...] = Field(default=(), alias="part", max_length=50)
    root: Root | None = None
    lock: tuple[Name, ...] = ()
    frames: tuple[Frame, ...] = Field(default=(), alias="frame")
    cameras: tuple[Camera, ...] = Field(default=(), alias="camera")
    sensors: tuple[Sensor, ...] = Field(default=(), alias="sensor")
    keyframes: dict[Name, dict[Name, float]] = Field(default={}, alias="keyframe")
    contacts: Contacts = Contacts()


def read_robot_file(path: Path) -> Component | Assembly:
    """Read a file that holds a component or an assembly; parsed once for equal text.

    Raises:
        ConfigError: If the file is neither, or violates the format.
        UnknownNameError: If it extends a component that does not exist.
    """
    text = read_text(path)
    name = as_table(_tables(str(path), text).get("component")).get("extends")
    if not isinstance(name, str):
        return _parsed(str(path), text, None)
    beside = [p.stem for p in path.parent.glob("*.toml") if p != path]
    if name not in beside:
        raise UnknownNameError("component to extend", name, beside)
    return _parsed(str(path), text, read_text(path.with_name(f"{name}.toml")))


@lru_cache(maxsize=256)
def _tables(source: str, text: str) -> dict[str, Any]:
    """Parse TOML; callers must not change the result."""
    return parse_toml(text, source=source)


@lru_cache(maxsize=256)
def _parsed(source: str, text: str, base: str | None) -> Component | Assembly:
    """Parse the text of a robot file, and that of the component it extends."""
    data = _tables(source, text)
    if "component" in data:
        if base is not None:
            header, inherited = data["component"], _tables(source, base)
            above = as_table(inherited.get("component"))
            if "extends" in above:
                raise ConfigError(
                    f"{source}: '{header['extends']}' itself extends another "
                    f"component; extend '{above['extends']}' instead."
                )
            data = inherited | data | {"component": above | header}
        component = parse_model(Component, data, source=source, error=DescriptionError)
        return reflect_component(component, source=source)
    if "assembly" in data:
        return parse_model(Assembly, data, source=source, error=DescriptionError)
    raise ConfigError(
        f"{source}: a robot file needs a table [component] (links and joints) or "
        f"[assembly] (parts); found {', '.join(sorted(data)) or 'nothing'}."
    )


RPY: dict[str, Any] = {
    "type": "array",
    "items": {"type": "number"},
    "minItems": 3,
    "maxItems": 3,
    "title": "Rpy",
    "description": "Roll, pitch, yaw in radians about fixed axes, instead of 'quat'.",
}


def robot_schema(kind: Literal["component", "assembly"]) -> dict[str, Any]:
    """Return the JSON Schema of a robot file, for completion in editors.

    `wbc-suite check` covers more: references, the tree and physics.
    """
    model = Component if kind == "component" else Assembly
    schema = model.model_json_schema(by_alias=True)
    if kind == "component":  # a component that extends another may inherit its links
        schema["required"].remove("link")
    for table in (schema, *schema.get("$defs", {}).values()):
        properties = table.get("properties", {})
        if "quat" in properties:
            properties["rpy"] = RPY
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
