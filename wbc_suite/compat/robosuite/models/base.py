"""MJCF as trees of elements, and what all models of robosuite can tell."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np

from wbc_suite.catalogue import Catalogue
from wbc_suite.compat.robosuite.utils.mjcf_utils import (
    Element,
    add_prefix,
    parse_file,
)
from wbc_suite.config_files import read_toml
from wbc_suite.robot import RobotDescription
from wbc_suite.scene.objects import Extent

SECTIONS = (
    *("worldbody", "asset", "actuator", "sensor", "tendon", "equality", "contact"),
    "default",
)


class MujocoXML:
    """MJCF: a file, or text that starts with `<`.

    Attributes:
        root: The tree; `worldbody`, `asset`, `actuator`, ... are its sections.
        folder: Folder of the file.
    """

    def __init__(self, fname: str | Path) -> None:
        text = str(fname)
        if text.lstrip().startswith("<"):
            self.root, self.folder = ET.fromstring(text), Path.cwd()
            self.file = ""
        else:
            self.root, self.folder = parse_file(fname)
            self.file = text
        for section in SECTIONS:
            setattr(self, section, self.create_default_element(section))
        self.worldbody: Element
        self.asset: Element
        self.actuator: Element

    def create_default_element(self, name: str) -> Element:
        """Return a section, a new one if there is none."""
        found = self.root.find(name)
        return ET.SubElement(self.root, name) if found is None else found

    def merge(self, others: Any, merge_body: str | None = "default") -> None:
        """Add bodies, assets and all other sections of other models.

        Bodies are added to the world, or to the body with the given name; None adds
        none.
        """
        for other in others if isinstance(others, list | tuple) else [others]:
            place = self.worldbody
            if merge_body not in (None, "default"):
                named = self.worldbody.iter("body")
                place = next(b for b in named if b.get("name") == merge_body)
            if merge_body is not None:
                place.extend(list(other.worldbody))
            self.merge_assets(other)
            for section in SECTIONS[2:]:
                getattr(self, section).extend(list(getattr(other, section)))

    def merge_assets(self, other: Any) -> None:
        """Add the assets of another model whose names are new."""
        known = {(a.tag, a.get("name", a.get("file"))) for a in self.asset}
        for asset in other.asset:
            if (asset.tag, asset.get("name", asset.get("file"))) not in known:
                self.asset.append(asset)

    def get_xml(self) -> str:
        """Return the text."""
        return ET.tostring(self.root, encoding="unicode")

    def get_model(self, mode: str = "mujoco") -> mujoco.MjModel:
        """Return the compiled model."""
        return mujoco.MjModel.from_xml_string(self.get_xml())

    def save_model(self, fname: str | Path, pretty: bool = False) -> None:
        """Write a file."""
        if pretty:
            ET.indent(self.root)
        Path(fname).write_text(self.get_xml(), encoding="utf-8")

    def get_element_names(self, root: Element, element_type: str) -> list[str]:
        """Return the names of all elements of a tag."""
        named = (e.get("name") for e in root.iter(element_type))
        return [name for name in named if name]

    @property
    def name(self) -> str:
        """Name of the model."""
        return self.root.get("model", "")


class MujocoModel:
    """What all models tell: names of their elements, in the scene, and their extent."""

    _name = ""
    theirs: Mapping[str, Mapping[str, str]] = MappingProxyType({})
    """robosuite's names of elements in a scene by kind and ours; none before that."""

    name: Any = property(lambda self: self._name, doc="Name of the model.")
    naming_prefix: Any = property(
        lambda self: f"{self.name}_", doc="Text before the names of its elements."
    )
    sites: Any = property(lambda self: [], doc="Names of its sites.")
    important_geoms: Any = property(lambda self: {}, doc="Names of geoms by role.")
    important_sites: Any = property(lambda self: {}, doc="Names of sites by role.")
    important_sensors: Any = property(lambda self: {}, doc="Names of sensors by role.")
    bottom_offset: Any = property(
        lambda self: np.array([0.0, 0.0, -self._extent().bottom]),
        doc="Offset of its lowest point from its origin, m.",
    )
    top_offset: Any = property(
        lambda self: np.array([0.0, 0.0, self._extent().top]),
        doc="Offset of its highest point from its origin, m.",
    )
    horizontal_radius: Any = property(
        lambda self: self._extent().radius,
        doc="Radius of its upright bounding cylinder, m.",
    )

    def _extent(self) -> Extent:
        """Return its upright bounding cylinder."""
        return Extent(radius=0.0, bottom=0.0, top=0.0)

    def shown(self, kind: str, names: Iterable[str]) -> list[str]:
        """Return the names of elements as the scene shows them."""
        known = self.theirs.get(kind, {})
        return [known.get(name, name) for name in names]

    def correct_naming(self, names: Any) -> Any:
        """Return names with the model's prefix: one, a list, or values of a table."""
        if isinstance(names, str):
            prefix = self.naming_prefix
            own = names.startswith(prefix) or self.exclude_from_prefixing(names)
            return names if own else prefix + names
        if isinstance(names, dict):
            return {key: self.correct_naming(value) for key, value in names.items()}
        return [self.correct_naming(name) for name in names]

    def exclude_from_prefixing(self, inp: Any) -> bool:
        """Whether a name stays as it is; by default none does."""
        return False

    def set_sites_visibility(self, sim: Any, visible: bool) -> None:
        """Show or hide the model's sites."""
        for name in self.sites:
            site = sim.model.site_name2id(name)
            alpha = abs(sim.model.site_rgba[site, 3])
            sim.model.site_rgba[site, 3] = alpha if visible else -alpha


class MujocoXMLModel(MujocoXML, MujocoModel):
    """A model of an MJCF file that has a name and a number in its scene."""

    def __init__(self, fname: str | Path, idn: Any = 0) -> None:
        super().__init__(fname)
        self.idn = idn


def shown_names(kind: str, own: str, doc: str) -> Any:
    """Return a property: the names in the scene of what an attribute lists of ours."""
    return property(lambda self: self.shown(kind, getattr(self, own)), doc=doc)


def element_names(elements: Iterable[Element]) -> list[str]:
    """Return the names of elements that have one."""
    return [e.get("name", "") for e in elements if e.get("name")]


class DescribedModel(MujocoXML, MujocoModel):
    """A model whose MJCF is that of a user's file, or of a description.

    `root`, `tree`, `worldbody`, `actuator`, ... exist when they are asked for; names in
    them start with `naming_prefix`.
    """

    description: RobotDescription
    own_file: str | None = None

    def __getattr__(self, name: str) -> Any:
        if name not in (*SECTIONS, "root", "tree", "folder"):
            raise AttributeError(f"{type(self).__name__} has no attribute '{name}'.")
        self._write()
        return self.__dict__[name]

    def _write(self) -> None:
        MujocoXML.__init__(self, self.own_file or self.description.to_mjcf())
        self.tree = ET.ElementTree(self.root)
        add_prefix(self.root, self.naming_prefix)


@cache
def choices_of(robot: str) -> dict[str, str]:
    """Return the parts of a robot of the catalogue that may be chosen, by name."""
    catalogue, found = Catalogue(), {}
    if not catalogue.holds("robots", robot):
        return found
    path = catalogue.find("robots", robot, kind="robot")
    for part in read_toml(path).get("part", ()):
        folder, _, stem = str(part.get("component", "")).partition("/")
        names = catalogue.names(f"robots/{folder}")
        if "choice" in part and stem in names:
            index = names.index(stem)
            found[part["name"]] = catalogue.called(f"robots/{folder}")[index]
    return found
