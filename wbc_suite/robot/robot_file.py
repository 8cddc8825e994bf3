"""Robot files (TOML): components, assemblies of components, and their JSON Schema.

`docs/robots.md` is the reference of all keys.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache, reduce
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from wbc_suite.catalogue import Catalogue, merge
from wbc_suite.config_files import FrozenModel, parse_model, parse_toml
from wbc_suite.errors import ConfigError, DescriptionError
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
from wbc_suite.robot.mirror import Mirror, reflect
from wbc_suite.robot.shapes import Posed, as_table


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


ADDED = ("frame", "camera", "sensor", "lock")
"""Lists of an assembly that follow those of the assembly that it extends."""

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


def read_robot_file(
    path: Path, catalogue: Catalogue | None = None
) -> Component | Assembly:
    """Read a file that holds a component or an assembly; parsed once for equal texts.

    Its tables are merged with those of the file that it extends. Lists of an assembly
    that name what it adds (`lock`, frames, cameras, sensors, contacts that are left
    out) follow those of its base; every other list replaces that of the base.

    Raises:
        ConfigError: If the file is neither, violates the format, or extends a file that
            does not exist.
    """
    texts: dict[str, str] = {}

    def base_of(file: Path) -> str | None:
        texts[str(file)] = read_text(file)
        name = _header(str(file), texts[str(file)])[1].get("extends")
        return name if isinstance(name, str) else None

    kind, header = _header(str(path), read_text(path))
    folder = f"robots/{header.get('kind', path.parent.name)}"
    (catalogue or Catalogue()).chain(
        "robots" if kind == "assembly" else folder,
        path,
        kind=f"{kind} to extend",
        base_of=base_of,
        key=f"{kind}.extends",
    )
    return _parsed(tuple(texts.items()))


@lru_cache(maxsize=256)
def _tables(source: str, text: str) -> dict[str, Any]:
    """Parse TOML; callers must not change the result."""
    return parse_toml(text, source=source)


def _header(source: str, text: str) -> tuple[str, dict[str, Any]]:
    """Return whether a file is a component or an assembly, and its header."""
    data = _tables(source, text)
    kind = "component" if "component" in data else "assembly"
    return kind, as_table(data.get(kind))


@lru_cache(maxsize=256)
def _parsed(files: tuple[tuple[str, str], ...]) -> Component | Assembly:
    """Parse a robot file and those that it extends, given by path and text."""
    (source, _), *bases = files
    layers = [_tables(*file) for file in files]
    own, data = layers[0], {**reduce(merge, reversed(layers))}
    if "component" in own:
        if bases:  # the skins of links are listed under the name of the first one
            data["component"]["extends"] = Path(bases[-1][0]).stem
        component = parse_model(Component, data, source=source, error=DescriptionError)
        return reflect_component(component, source=source)
    if "assembly" in own:
        for key in ADDED:
            data[key] = _joined(layers, key)
        excluded = _joined([as_table(x.get("contacts")) for x in layers], "exclude")
        data["contacts"] = as_table(data.get("contacts")) | {"exclude": excluded}
        assembly = parse_model(Assembly, data, source=source, error=DescriptionError)
        mine = next((s for s, text in files if "part" in _tables(s, text)), source)
        parts = tuple(_located(part, Path(mine).parent) for part in assembly.parts)
        return assembly.model_copy(update={"parts": parts})
    raise ConfigError(
        f"{source}: a robot file needs a table [component] (links and joints) or "
        f"[assembly] (parts); found {', '.join(sorted(own)) or 'nothing'}."
    )


def reflect_component(component: Component, *, source: str) -> Component:
    """Return the component with both sides; raises DescriptionError."""
    if component.mirror is None:
        return component
    both = reflect(component, component.mirror, source=source)
    return both.model_copy(update={"mirror": None})


def _joined(layers: Sequence[Mapping[str, Any]], key: str) -> Any:
    """Return the lists of all layers, that of the base first; what is no list as is."""
    given = [layer[key] for layer in reversed(layers) if key in layer]
    wrong = (value for value in given if not isinstance(value, list))
    return next(wrong, [item for value in given for item in value])


def _located(part: Part, folder: Path) -> Part:
    """Return the part with an absolute path below the assembly's folder."""
    if not is_path(part.component):
        return part
    path = (folder / part.component).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise ConfigError(
            f"'{part.component}' lies outside the folder {folder}: components must be "
            "in the folder of the assembly, below it, or in the catalogue."
        )
    return part.model_copy(update={"component": str(path)})


def is_path(name: str) -> bool:
    """Whether a component is given by a file and not by its catalogue name."""
    return name.lower().endswith((".toml", ".urdf", ".xml", ".mjcf"))


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
