"""Robots and grippers of ours as trees of MJCF elements, for scenes made by hand."""

import xml.etree.ElementTree as ET
from functools import cache
from typing import Any

from wbc_suite.catalogue import Catalogue
from wbc_suite.compat.robosuite.models.base import SECTIONS, MujocoModel, MujocoXML
from wbc_suite.compat.robosuite.utils.mjcf_utils import add_prefix
from wbc_suite.robot import RobotDescription
from wbc_suite.tomlfile import read_toml


class DescribedModel(MujocoXML, MujocoModel):  # pyright: ignore[reportIncompatibleVariableOverride] - subclasses define `name`
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
