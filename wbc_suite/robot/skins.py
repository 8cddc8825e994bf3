"""Skins: meshes of other packages, drawn instead of a robot's own visual shapes.

A table `robots/skin/NAME.toml` lists the mesh files of a public package for each link
of component NAME. They are found in an installed package, which is not imported, or in
a folder of the user. Physics does not change.
"""

import importlib.util
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Literal

from pydantic import Field

from wbc_suite import logs
from wbc_suite.catalogue import Catalogue, user_cache_root
from wbc_suite.config_files import FrozenModel, load_model
from wbc_suite.errors import ConfigError, UnknownNameError, look_up
from wbc_suite.robot.elements import Name
from wbc_suite.robot.mesh_files import MeshIndex
from wbc_suite.robot.shapes import Color, Posed, SkinMesh, Vector3

log = logs.logger(__name__)

MESHES, PLAIN = "meshes", "none"
"""Skins from installed packages, and none; any other skin is a folder."""


def _module(name: str) -> Iterator[Path]:
    spec = importlib.util.find_spec(name)
    return map(Path, (spec and spec.submodule_search_locations) or ())


def _menagerie() -> Iterator[Path]:
    """Yield the caches of `mujoco-menagerie`: one folder per model and version."""
    if root := os.environ.get("MENAGERIE_ROOT"):
        yield Path(root)
    home = user_cache_root()
    if sys.platform == "darwin":
        home = Path.home() / "Library/Caches"
    own = os.environ.get("MENAGERIE_CACHE_DIR") or home / "mujoco_menagerie"
    yield Path(own) / "models"


ROBOT_DATA = "cmeel.prefix/share/example-robot-data/robots"
PROVIDERS: Mapping[str, tuple[str, Callable[[], Iterable[Path]]]] = {
    "robosuite": ("pip install --no-deps robosuite", lambda: _module("robosuite")),
    "fourier_robot_descriptions": (
        "pip install --no-deps fourier-robot-descriptions",
        lambda: _module("fourier_robot_descriptions"),
    ),
    "example_robot_data": (
        "pip install --no-deps example-robot-data",
        lambda: (Path(p) / ROBOT_DATA for p in sys.path),
    ),
    "mujoco_menagerie": (
        "pip install mujoco-menagerie, and its command to fetch the model",
        _menagerie,
    ),
    "robotiq_description": (
        "a folder with the meshes of the ROS package robotiq_description",
        tuple,
    ),
}
"""How to install each package with meshes, and the folders that paths start from."""


class _Piece(Posed):
    """One mesh file in a link's frame."""

    file: str = Field(min_length=1, max_length=300)
    color: Color = "grey"
    scale: Vector3 = (1.0, 1.0, 1.0)


class SkinTable(FrozenModel):
    """One file `robots/skin/NAME.toml`: the meshes of each link of component NAME."""

    format: Literal[1]
    provider: str
    folder: str = ""
    link: dict[Name, tuple[_Piece, ...]]


class SkinFinder:
    """Finds the meshes of components and reports missing ones once.

    The skin "meshes" are those of installed packages; in a folder meshes are looked up
    by path or, if only one file matches, by name.

    Raises:
        ConfigError: If the folder does not exist.
    """

    def __init__(self, skin: str | Path, catalogue: Catalogue) -> None:
        self._catalogue = catalogue
        self._folder = None if str(skin) == MESHES else Path(skin).expanduser()
        if self._folder is not None and not self._folder.is_dir():
            raise ConfigError(
                f"skin: '{skin}' is neither '{MESHES}' nor a folder with meshes."
            )
        self._index = None if self._folder is None else MeshIndex(self._folder)
        self._missing: dict[str, list[str]] = {}
        self._found = False

    def meshes(
        self, component: str, links: Iterable[str]
    ) -> dict[str, tuple[SkinMesh, ...]]:
        """Return the meshes of each link of a component; empty without a skin."""
        if not self._catalogue.holds("robots/skin", component):
            return {}
        path = self._catalogue.find("robots/skin", component, kind="skin")
        table = read_skin(path)
        names = set(links)
        for name in table.link:
            if name not in names:
                raise UnknownNameError("link of a skin", name, names)
        pieces = [piece for own in table.link.values() for piece in own]
        files = {piece.file: self._locate(table, piece.file) for piece in pieces}
        if None in files.values():
            self._missing.setdefault(table.provider, []).append(component)
            return {}
        self._found = True
        return {
            link: tuple(
                SkinMesh.model_validate(
                    piece.model_dump()
                    | {"shape": "skin", "file": str(files[piece.file])}
                )
                for piece in own
            )
            for link, own in table.link.items()
        }

    def report_missing(self) -> None:
        """Log a warning about missing meshes; raises ConfigError if none was found."""
        where = f" below {self._folder}" if self._folder else ""
        lines = [
            f"the meshes of {', '.join(names)} were not found{where}. To install "
            f"them: {PROVIDERS[provider][0]}"
            for provider, names in self._missing.items()
        ]
        if lines and not self._found:
            raise ConfigError(f"skin: {'; '.join(lines)}.")
        if not self._found:
            raise ConfigError("skin: there are no meshes for this robot.")
        for line in lines:
            log.warning("skin: %s", line)

    def _locate(self, table: SkinTable, file: str) -> Path | None:
        inside = Path(table.folder) / file
        if self._index is not None:
            return self._index.find(inside)
        first, *rest = inside.parts
        versioned = "/".join((f"{first}-*", *rest))  # the folder name-1a2b of a version
        for folder in PROVIDERS[table.provider][1]():
            for path in (folder / inside, *folder.glob(versioned)):
                if path.is_file():
                    return path
        return None


def read_skin(path: Path) -> SkinTable:
    """Read a table of meshes; raises ConfigError or UnknownNameError."""
    table = load_model(SkinTable, path)
    look_up("provider of meshes", table.provider, PROVIDERS)
    return table
