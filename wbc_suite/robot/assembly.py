"""Join components into one robot."""

import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError, DescriptionError, UnknownNameError
from wbc_suite.robot.choosing import Choice, choose, is_bare, is_path
from wbc_suite.robot.component import Assembly, Component, Part, read_robot_file
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.parts import Frame, Link, Mount, Root, Synergy
from wbc_suite.robot.placing import (
    compose,
    depth_first,
    locked,
    painted,
    renamed,
    repainted,
)
from wbc_suite.robot.shapes import SkinMesh
from wbc_suite.robot.skins import Wardrobe
from wbc_suite.tomlfile import parse_model

__all__ = ["assemble", "describe_component", "read_assembly"]


def describe_component(
    component: Component, *, source: str, wardrobe: Wardrobe | None = None
) -> RobotDescription:
    """Make a robot of one component alone; without a body it stands still."""
    header = component.component
    data = _collect(component) | {
        "name": header.name,
        "title": header.title,
        "source": header.source,
        "license": header.license,
        "deviations": header.deviations,
        "root": Root() if is_bare(component) else component.root,
        "links": depth_first(component.links),
        "synergies": _by_gripper(component.synergies),
        "skins": _skins(component, wardrobe),
    }
    return parse_model(RobotDescription, data, source=source, error=DescriptionError)


def _skins(
    component: Component,
    wardrobe: Wardrobe | None,
    prefix: str = "",
    colors: Mapping[str, str] | None = None,
) -> dict[str, tuple[SkinMesh, ...]]:
    """Return the meshes of a component's links; names get a prefix, colours change."""
    if wardrobe is None:
        return {}
    links = [link.name for link in component.links]
    header = component.component
    found = wardrobe.dress(header.extends or header.name, links)
    return {prefix + n: painted(meshes, colors or {}) for n, meshes in found.items()}


def _by_gripper(
    synergies: tuple[Synergy, ...], called: str = "gripper"
) -> dict[str, tuple[Synergy, ...]]:
    """Sort synergies by gripper; the one without a name of its own is `called` so."""
    sorted_out: dict[str, tuple[Synergy, ...]] = {}
    for synergy in synergies:
        name = called if synergy.gripper == "gripper" else synergy.gripper
        own = synergy.model_copy(update={"gripper": name})
        sorted_out[name] = (*sorted_out.get(name, ()), own)
    return sorted_out


def assemble(
    path: Path,
    *,
    catalogue: Catalogue,
    gripper: Choice = None,
    base: Choice = None,
    wardrobe: Wardrobe | None = None,
) -> RobotDescription:
    """Read an assembly file and mount its parts.

    Args:
        path: The assembly's file.
        catalogue: Where components are looked up.
        gripper: Other grippers: a name for all, or a mapping from side to name.
        base: Another base.
        wardrobe: Where to take meshes from.

    Raises:
        DescriptionError: If a part, a mount or a name does not fit.
        UnknownNameError: If a component does not exist.
    """
    builder = _Builder(path, catalogue, wardrobe)
    own = read_assembly(path, catalogue)
    assembly = choose(
        own,
        gripper=gripper,
        base=base,
        read=builder.read,
        catalogue=catalogue,
    )
    names = [builder.read(part).component.name for part in assembly.parts]
    for part, name in zip(assembly.parts, names, strict=True):
        builder.mount(part, shared=names.count(name) > 1)
    kept = {part.name for part in assembly.parts}
    for part in own.parts:
        if part.choice == "gripper" and part.name not in kept:
            builder.leave_bare(part)
    return builder.finish(assembly)


def read_assembly(path: Path, catalogue: Catalogue, depth: int = 0) -> Assembly:
    """Read an assembly, and lay it over the one that it extends."""
    if depth > 5:
        raise DescriptionError(f"{path}: 'extends' goes round in a circle.")
    own = read_robot_file(path)
    if not isinstance(own, Assembly):
        raise DescriptionError(f"{path}: this is a component, not an assembly.")
    parts = tuple(_located(part, path.parent) for part in own.parts)
    if "parts" in own.model_fields_set:
        own = own.model_copy(update={"parts": parts})
    if own.assembly.extends is None:
        return own
    parent = read_assembly(
        catalogue.find("robots", own.assembly.extends, kind="robot"),
        catalogue,
        depth + 1,
    )
    given = {key: getattr(own, key) for key in own.model_fields_set}
    for key in ("frames", "cameras", "sensors", "lock"):
        given[key] = (*getattr(parent, key), *getattr(own, key))
    given["keyframes"] = parent.keyframes | own.keyframes
    given["contacts"] = parent.contacts.model_copy(
        update={"exclude": (*parent.contacts.exclude, *own.contacts.exclude)}
    )
    header = parent.assembly.model_dump() | own.assembly.model_dump(exclude_unset=True)
    given["assembly"] = type(own.assembly).model_validate(header)
    return parent.model_copy(update=given)


class _Builder:
    """Collects the parts of one assembly."""

    def __init__(
        self, path: Path, catalogue: Catalogue, wardrobe: Wardrobe | None
    ) -> None:
        self._path, self._wardrobe = path, wardrobe
        self._skins: dict[str, tuple[SkinMesh, ...]] = {}
        self._catalogue = catalogue
        self._links: list[Link] = []
        self._mounts: dict[str, Mount] = {}
        self._items: dict[str, list[Any]] = {}
        self._headers: list[tuple[str, str, tuple[str, ...]]] = []
        self._groups: dict[str, tuple[str, ...]] = {}
        self._keyframes: dict[str, dict[str, float]] = {}
        self._materials: dict[str, Any] = {}
        self._synergies: dict[str, tuple[Synergy, ...]] = {}
        self._excludes: list[tuple[str, str]] = []
        self._root = Root()

    def mount(self, part: Part, *, shared: bool) -> None:
        """Add one component."""
        component = self.read(part)
        bodies = self._prefix(part, component, shared=shared)
        repaint = self._other_colors(component, part.name)
        self._skins |= _skins(component, self._wardrobe, bodies, repaint)
        component = renamed(
            repainted(component, repaint),
            items=f"{part.side}_" if part.side else "",
            bodies=bodies,
            part=part.name,
        )
        links = depth_first(component.links)
        if not self._links:
            self._root = component.root
        first = links[0].model_copy(update=self._placement(part, links[0]))
        self._links += [first, *links[1:]]
        for mount in component.mounts:
            self._mounts[f"{part.name}.{mount.name}"] = mount
        data = _collect(component)
        for key in _LISTS:
            self._items.setdefault(key, []).extend(data[key])
        for group, joints in component.groups.items():
            self._groups[group] = (*self._groups.get(group, ()), *joints)
        for name, values in component.keyframes.items():
            self._keyframes[name] = self._keyframes.get(name, {}) | values
        self._materials |= data["materials"]
        self._excludes += component.contacts.exclude
        self._synergies |= _by_gripper(component.synergies, called=part.name)
        header = component.component
        self._headers.append((header.source, header.license, header.deviations))

    def leave_bare(self, part: Part) -> None:
        """Put the `tcp` of a gripper that is left out at the flange."""
        mount = self._mounts.get(part.on or "")
        if mount is None:
            return
        name = f"{part.side}_tcp" if part.side else "tcp"
        fields = {"name": name, "link": mount.link, "role": "tcp"}
        frame = Frame.model_validate(fields | compose(mount, part))
        self._items.setdefault("frames", []).append(frame)

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
        component = read_robot_file(path)
        if not isinstance(component, Component):
            raise DescriptionError(f"{path}: a part must be a component.")
        return component

    def _prefix(self, part: Part, component: Component, *, shared: bool) -> str:
        """Return what makes the component's links and joints differ from those here."""
        taken = {name for link in self._links for name in _names(link)}
        own = [name for link in component.links for name in _names(link)]
        side = f"{part.side or part.name}_"
        plain = not (shared if part.rename is None else part.rename)
        choices = ["", side, f"{part.name}_"] if plain else [side, f"{part.name}_"]
        fitting = (c for c in choices if not any(c + name in taken for name in own))
        return choices[0] if part.rename is False else next(fitting, choices[0])

    def _other_colors(self, component: Component, part: str) -> dict[str, str]:
        """Return new names for materials whose name has another colour elsewhere."""
        own = _collect(component)["materials"]
        known = self._materials
        return {n: f"{part}_{n}" for n, c in own.items() if known.get(n, c) != c}

    def _placement(self, part: Part, link: Link) -> dict[str, Any]:
        if not self._links:
            return {}
        if part.on is None:
            raise DescriptionError(
                f"{self._path}: part '{part.name}' needs 'on': only the first part "
                "stands alone."
            )
        mount = self._mounts.get(part.on)
        if mount is None:
            raise DescriptionError(
                f"{self._path}: {UnknownNameError('mount', part.on, self._mounts)}"
            )
        return compose(mount, part, link) | {"parent": mount.link}

    def finish(self, assembly: Assembly) -> RobotDescription:
        """Check and freeze the whole."""
        keyframes = dict(self._keyframes)
        for name, values in assembly.keyframes.items():
            keyframes[name] = keyframes.get(name, {}) | values
        header = assembly.assembly
        data: dict[str, Any] = {
            key: [*items, *getattr(assembly, key, ())]
            for key, items in self._items.items()
        }
        sources = [s for s, _, _ in self._headers]
        licenses = [text for _, text, _ in self._headers]
        deviations = itertools.chain(*(d for _, _, d in self._headers))
        data |= {
            "name": header.name,
            "title": header.title,
            "source": "; ".join(dict.fromkeys(filter(None, sources))),
            "license": "; ".join(dict.fromkeys(filter(None, licenses))),
            "deviations": (*deviations, *header.deviations),
            "root": assembly.root or self._root,
            "links": depth_first(tuple(self._links)),
            "groups": self._groups,
            "keyframes": keyframes,
            "materials": self._materials,
            "synergies": self._synergies,
            "skins": self._skins,
            "contacts": {"exclude": (*self._excludes, *assembly.contacts.exclude)},
        }
        data = locked(data, assembly.lock)
        return parse_model(
            RobotDescription, data, source=str(self._path), error=DescriptionError
        )


def _names(link: Link) -> tuple[str, ...]:
    return (link.name,) if link.joint is None else (link.name, link.joint.name)


_LISTS = ("frames", "cameras", "actuators", "sensors", "connects")


def _collect(component: Component) -> dict[str, Any]:
    """Return the fields that a component shares with a robot."""
    keys = ("groups", "keyframes", "contacts", "mounts", *_LISTS)
    data = {key: getattr(component, key) for key in keys}
    data["materials"] = {
        name: (*color, 1.0)[:4] for name, color in component.materials.items()
    }
    return data


def _located(part: Part, folder: Path) -> Part:
    """Make the path of a component absolute; it lies beside or below its assembly.

    Raises:
        ConfigError: If it leaves the folder.
    """
    if not is_path(part.component):
        return part
    path = (folder / part.component).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise ConfigError(
            f"'{part.component}' leaves the folder {folder}: components lie beside or "
            "below the assembly, or in a catalogue folder."
        )
    return part.model_copy(update={"component": str(path)})
