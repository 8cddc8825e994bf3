"""Join components into one robot."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from wbc_suite.catalogue import Catalogue
from wbc_suite.config_files import parse_model
from wbc_suite.errors import DescriptionError, UnknownNameError
from wbc_suite.robot.assembly_steps import (
    LISTS,
    depth_first,
    locked,
    prefixed,
    recolored,
    with_colors,
)
from wbc_suite.robot.component_choice import Choice, choose, is_bare
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Elements, Frame, Link, Mount, Root, Synergy
from wbc_suite.robot.poses import compose
from wbc_suite.robot.robot_file import (
    SOURCES,
    Assembly,
    Component,
    Header,
    Part,
    is_path,
    read_robot_file,
)
from wbc_suite.robot.shapes import Drawn
from wbc_suite.robot.skins import SkinFinder

TABLES = ("groups", "keyframes", "materials", "synergies", "skins")
"""Fields of a robot that are joined by name."""


def describe_component(
    component: Component, *, source: str, skins: SkinFinder | None = None
) -> RobotDescription:
    """Build a robot from a single component; one without body has a fixed root."""
    header = component.component
    data = {key: getattr(component, key) for key in Elements.model_fields}
    data |= {key: getattr(header, key) for key in SOURCES}
    data |= {
        "root": Root() if is_bare(component) else component.root,
        "links": depth_first(component.links),
        "synergies": _by_gripper(component.synergies),
        "skins": _skins(component, skins),
    }
    return parse_model(RobotDescription, data, source=source, error=DescriptionError)


def _skins(
    component: Component,
    skins: SkinFinder | None,
    prefix: str = "",
    colors: Mapping[str, str] | None = None,
) -> dict[str, tuple[Drawn, ...]]:
    """Return the meshes of a component's links, with prefixed names."""
    if skins is None:
        return {}
    header = component.component
    plain = describe_component(component, source=header.name)
    found = skins.meshes(header.extends or header.name, plain)
    return {prefix + n: with_colors(own, colors or {}) for n, own in found.items()}


def _by_gripper(
    synergies: tuple[Synergy, ...], part: str = "gripper"
) -> dict[str, tuple[Synergy, ...]]:
    """Sort synergies by gripper; a gripper `gripper` gets the name of its part."""
    grouped: dict[str, tuple[Synergy, ...]] = {}
    for synergy in synergies:
        name = part if synergy.gripper == "gripper" else synergy.gripper
        own = synergy.model_copy(update={"gripper": name})
        grouped[name] = (*grouped.get(name, ()), own)
    return grouped


def assemble(
    path: Path,
    *,
    catalogue: Catalogue,
    gripper: Choice = None,
    base: Choice = None,
    skins: SkinFinder | None = None,
) -> RobotDescription:
    """Read an assembly file and mount its parts.

    Raises:
        DescriptionError: If a part, a mount or a name does not fit.
        UnknownNameError: If a component does not exist.
    """
    builder = _Builder(path, catalogue, skins)
    own = read_assembly(path, catalogue)
    assembly = choose(
        own, gripper=gripper, base=base, read=builder.read, catalogue=catalogue
    )
    names = [builder.read(part).component.name for part in assembly.parts]
    for part, name in zip(assembly.parts, names, strict=True):
        builder.mount(part, shared=names.count(name) > 1)
    kept = {part.name for part in assembly.parts}
    for part in own.parts:
        if part.choice == "gripper" and part.name not in kept:
            builder.add_bare_tcp(part)
    return builder.finish(assembly)


def read_assembly(path: Path, catalogue: Catalogue) -> Assembly:
    """Read an assembly together with those that it extends."""
    found = read_robot_file(path, catalogue)
    if not isinstance(found, Assembly):
        raise DescriptionError(f"{path}: this is a component, not an assembly.")
    return found


class _Builder:
    """Collects the parts of one assembly."""

    def __init__(
        self, path: Path, catalogue: Catalogue, skins: SkinFinder | None
    ) -> None:
        self._path, self._catalogue, self._finder = path, catalogue, skins
        self._mounts: dict[str, Mount] = {}
        self._headers: list[Header] = []
        self._read: dict[Path, Component] = {}
        self._links: list[Link] = []
        self._excludes: list[tuple[str, str]] = []
        self._fields: dict[str, Any] = {key: [] for key in LISTS}
        self._fields |= {key: {} for key in TABLES}

    def mount(self, part: Part, *, shared: bool) -> None:
        """Add one component."""
        component = self.read(part)
        bodies = self._prefix(part, component, shared=shared)
        fields, known = self._fields, self._fields["materials"]
        colors = {  # a name that has another colour elsewhere gets a prefix
            name: f"{part.name}_{name}"
            for name, color in component.materials.items()
            if known.get(name, color) != color
        }
        fields["skins"] |= _skins(component, self._finder, bodies, colors)
        component = prefixed(
            recolored(component, colors),
            items=f"{part.side}_" if part.side else "",
            bodies=bodies,
            part=part.name,
        )
        links = depth_first(component.links)
        fields.setdefault("root", component.root)
        first = links[0].model_copy(update=self._placement(part, links[0]))
        self._links += [first, *links[1:]]
        for mount in component.mounts:
            self._mounts[f"{part.name}.{mount.name}"] = mount
        for key in LISTS:
            fields[key] += getattr(component, key)
        for group, joints in component.groups.items():
            fields["groups"][group] = (*fields["groups"].get(group, ()), *joints)
        self._add_keyframes(component.keyframes)
        fields["materials"] |= component.materials
        fields["synergies"] |= _by_gripper(component.synergies, part.name)
        self._excludes += component.contacts.exclude
        self._headers.append(component.component)

    def add_bare_tcp(self, part: Part) -> None:
        """Put the `tcp` of a gripper that is left out at the flange."""
        mount = self._mounts.get(part.on or "")
        if mount is None:
            return
        name = f"{part.side}_tcp" if part.side else "tcp"
        fields = {"name": name, "link": mount.link, "role": "tcp"}
        frame = Frame.model_validate(fields | compose(mount, part))
        self._fields["frames"].append(frame)

    def read(self, part: Part) -> Component:
        """Read the component of a part."""
        if is_path(part.component):
            path = Path(part.component)
        else:
            folder, _, name = part.component.rpartition("/")
            path = self._catalogue.find(
                f"robots/{folder}".rstrip("/"),
                name,
                kind=folder or "component",
                side=part.side,
            )
        if path in self._read:
            return self._read[path]
        if path.suffix == ".toml":
            component = read_robot_file(path, self._catalogue)
        else:
            from wbc_suite.robot.adopt.hand_file import read_hand

            component = read_hand(path)
        if not isinstance(component, Component):
            raise DescriptionError(f"{path}: a part must be a component.")
        self._read[path] = component
        return component

    def _prefix(self, part: Part, component: Component, *, shared: bool) -> str:
        """Return the prefix that makes the names of links and joints unique."""
        taken = {name for link in self._links for name in _names(link)}
        taken |= {frame.name for frame in self._fields["frames"]}
        own = [name for link in component.links for name in _names(link)]
        side = f"{part.side or part.name}_"
        plain = not (shared if part.rename is None else part.rename)
        choices = ["", side, f"{part.name}_"] if plain else [side, f"{part.name}_"]
        fitting = (c for c in choices if not any(c + name in taken for name in own))
        return choices[0] if part.rename is False else next(fitting, choices[0])

    def _placement(self, part: Part, link: Link) -> dict[str, Any]:
        if not self._links:
            return {}
        if part.on is None:
            raise DescriptionError(
                f"{self._path}: part '{part.name}' needs 'on': all parts but the "
                "first are mounted on another part."
            )
        mount = self._mounts.get(part.on)
        if mount is None:
            raise DescriptionError(
                f"{self._path}: {UnknownNameError('mount', part.on, self._mounts)}"
            )
        return compose(mount, part, link) | {"parent": mount.link}

    def _add_keyframes(self, keyframes: Mapping[str, dict[str, float]]) -> None:
        known = self._fields["keyframes"]
        for name, values in keyframes.items():
            known[name] = known.get(name, {}) | values

    def finish(self, assembly: Assembly) -> RobotDescription:
        """Return the validated robot."""
        self._add_keyframes(assembly.keyframes)
        fields, header = self._fields, assembly.assembly
        for key in LISTS:
            fields[key] += getattr(assembly, key, ())
        fields |= {
            "name": header.name,
            "title": header.title,
            "source": _joined(own.source for own in self._headers),
            "license": _joined(own.license for own in self._headers),
            "deviations": [
                text for own in (*self._headers, header) for text in own.deviations
            ],
            "root": assembly.root or fields.get("root", Root()),
            "links": depth_first(tuple(self._links)),
            "contacts": {"exclude": (*self._excludes, *assembly.contacts.exclude)},
        }
        fields = locked(fields, assembly.lock)
        source = str(self._path)
        try:
            return parse_model(
                RobotDescription, fields, source=source, error=DescriptionError
            )
        except DescriptionError:
            for path, component in self._read.items():  # names its file, if it can
                describe_component(component, source=str(path))
            raise


def _joined(texts: Iterable[str]) -> str:
    return "; ".join(dict.fromkeys(filter(None, texts)))


def _names(link: Link) -> tuple[str, ...]:
    return (link.name,) if link.joint is None else (link.name, link.joint.name)
