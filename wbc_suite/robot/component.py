"""The two kinds of robot file: a component, and an assembly of components."""

from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field

from wbc_suite.errors import ConfigError, DescriptionError, UnknownNameError
from wbc_suite.robot.mirror import Mirror, reflect_component
from wbc_suite.robot.parts import (
    Actuator,
    Camera,
    Connect,
    Contacts,
    Frame,
    Link,
    Mount,
    Name,
    Root,
    Sensor,
    Synergy,
)
from wbc_suite.robot.shapes import Posed, as_table
from wbc_suite.tomlfile import FrozenModel, parse_model, parse_toml, read_text

__all__ = ["Assembly", "Component", "Part", "read_robot_file"]

Channel: TypeAlias = Annotated[float, Field(ge=0.0, le=1.0)]
Rgb: TypeAlias = tuple[Channel, Channel, Channel]
Rgba: TypeAlias = tuple[Channel, Channel, Channel, Channel]


class Header(FrozenModel):
    """What a component is, and where its figures come from.

    Attributes:
        name: Unique name.
        kind: Folder of the catalogue in which it lies.
        side: The side that a hand is made for; absent when it fits both.
        extends: Another component of the same folder that this one changes: tables
            given here, such as `synergy`, replace its tables.
        title: Name for people.
        source: Where the figures come from, in words.
        license: Licence of the figures.
        deviations: Each deliberate difference from the source, with its reason.
    """

    name: Name
    kind: Literal["arm", "body", "gripper", "base"]
    side: Literal["left", "right"] | None = None
    extends: Name | None = None
    title: str = ""
    source: str = ""
    license: str = ""
    deviations: tuple[str, ...] = ()


class Component(FrozenModel):
    """One component file, such as `robots/arm/panda.toml`.

    The tables' names are singular, as TOML writes them: `[[link]]`, `[[frame]]`.
    """

    format: Literal[1]
    component: Header
    materials: dict[Name, Rgb | Rgba] = {}
    links: tuple[Link, ...] = Field(alias="link", max_length=500)
    frames: tuple[Frame, ...] = Field(default=(), alias="frame")
    mounts: tuple[Mount, ...] = Field(default=(), alias="mount")
    cameras: tuple[Camera, ...] = Field(default=(), alias="camera")
    actuators: tuple[Actuator, ...] = Field(default=(), alias="actuator")
    sensors: tuple[Sensor, ...] = Field(default=(), alias="sensor")
    synergies: tuple[Synergy, ...] = Field(default=(), alias="synergy")
    connects: tuple[Connect, ...] = Field(default=(), alias="connect")
    groups: dict[Name, tuple[Name, ...]] = {}
    keyframes: dict[Name, dict[Name, float]] = Field(default={}, alias="keyframe")
    contacts: Contacts = Contacts()
    root: Root = Root()
    mirror: Mirror | None = None


class Part(Posed):
    """One component in an assembly.

    Attributes:
        name: Name of the part, such as `arm` or `right_gripper`.
        component: Catalogue name with folder, such as `gripper/panda_hand`, or a path
            to a TOML file relative to the assembly's file.
        on: Where it is mounted: `part.mount`; absent for the first part.
        side: Prefix of the component's frames, groups, cameras and sensors, so that
            `tcp` becomes `right_tcp`.
        rename: Whether links and joints get that prefix too. By default they do when
            two parts share a component.
        choice: The argument of `load_robot` that may replace the component.
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
    """One assembly file, such as `robots/panda.toml`.

    Attributes:
        format: Version of the format.
        assembly: Name; `extends` takes over another assembly and changes it.
        parts: Components, each mounted on an earlier one.
        root: How the robot stands in the world; by default as its first part says.
        lock: Groups whose joints are fixed in the `ready` posture.
        groups: Further groups, or renamed ones.
        frames: Further frames.
        cameras: Further cameras.
        keyframes: Postures of the whole robot; they win over the components' own.
        contacts: Pairs of links, across components too, that never collide.
    """

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
    """Read a component or an assembly, whichever the file holds.

    A file that was read before, and has the same text still, is not parsed again.

    Raises:
        ConfigError: If the file is neither, or breaks a rule of the format.
    """
    text = read_text(path)
    base = _extended_file(path, text)
    return _parsed(str(path), text, base and read_text(base))


@lru_cache(maxsize=256)
def _tables(source: str, text: str) -> dict[str, Any]:
    """Parse TOML; nobody changes what this returns."""
    return parse_toml(text, source=source)


@lru_cache(maxsize=256)
def _parsed(source: str, text: str, base: str | None) -> Component | Assembly:
    """Read the text of a robot file, and that of the component it extends."""
    data = _tables(source, text)
    if "component" in data:
        if base is not None:
            data = _extended(data, _tables(source, base), source=source)
        component = parse_model(Component, data, source=source, error=DescriptionError)
        return reflect_component(component, source=source)
    if "assembly" in data:
        return parse_model(Assembly, data, source=source, error=DescriptionError)
    raise ConfigError(
        f"{source}: a robot file has a table [component] (links and joints) or "
        f"[assembly] (parts); this one has {', '.join(sorted(data)) or 'nothing'}."
    )


def _extended_file(path: Path, text: str) -> Path | None:
    """Return the file beside it that a component extends."""
    name = as_table(_tables(str(path), text).get("component")).get("extends")
    if not isinstance(name, str):
        return None
    beside = [p.stem for p in path.parent.glob("*.toml") if p != path]
    if name not in beside:
        raise UnknownNameError("component to extend", name, beside)
    return path.with_name(f"{name}.toml")


def _extended(
    data: dict[str, Any], base: dict[str, Any], *, source: str
) -> dict[str, Any]:
    """Lay a component's tables over those of the one that it extends."""
    header, inherited = as_table(data["component"]), as_table(base.get("component"))
    if "extends" in inherited:
        raise ConfigError(
            f"{source}: '{header['extends']}' extends another component itself; extend "
            f"'{inherited['extends']}'."
        )
    return base | data | {"component": inherited | header}
