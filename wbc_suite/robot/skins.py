"""Real meshes as an optional dress over our own shapes.

No mesh is shipped. A table `robots/skin/NAME.toml` says for each link of a component
which mesh file of which public package belongs where; the files are found in an
installed package, without importing it, or in a folder of the user's. A dressed robot
looks different and is otherwise the same: masses, joints and collisions stay ours.
"""

import importlib.util
import logging
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

from pydantic import Field

from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot.parts import Name
from wbc_suite.robot.shapes import Color, Posed, SkinMesh, Vector3
from wbc_suite.tomlfile import FrozenModel, load_model
from wbc_suite.user_cache import user_cache_root

__all__ = ["MESHES", "SkinTable", "Wardrobe", "read_skin"]

log = logging.getLogger(__name__)

MESHES = "meshes"
"""The skin that is looked for in installed packages; any other is a folder."""


@dataclass(frozen=True, slots=True)
class _Provider:
    """A package that carries meshes, and what a user types to get it."""

    install: str
    module: str | None = None
    shared: str | None = None  # folder below an entry of sys.path

    def folders(self) -> Iterator[Path]:
        """Yield the folders that its files are given relative to."""
        if self.module is not None:
            spec = importlib.util.find_spec(self.module)
            for place in (spec and spec.submodule_search_locations) or ():
                yield Path(place)
        if self.shared is not None:
            for place in sys.path:
                if (folder := Path(place) / self.shared).is_dir():
                    yield folder


class _Menagerie(_Provider):
    """The cache of the package `mujoco-menagerie`: one folder a model and version."""

    def folders(self) -> Iterator[Path]:
        if root := os.environ.get("MENAGERIE_ROOT"):
            yield Path(root)
        home = user_cache_root()
        if sys.platform == "darwin":
            home = Path.home() / "Library/Caches"
        own = os.environ.get("MENAGERIE_CACHE_DIR") or home / "mujoco_menagerie"
        yield Path(own) / "models"


PROVIDERS: Mapping[str, _Provider] = {
    "robosuite": _Provider("pip install --no-deps robosuite", module="robosuite"),
    "fourier_robot_descriptions": _Provider(
        "pip install --no-deps fourier-robot-descriptions",
        module="fourier_robot_descriptions",
    ),
    "example_robot_data": _Provider(
        "pip install --no-deps example-robot-data",
        shared="cmeel.prefix/share/example-robot-data/robots",
    ),
    "mujoco_menagerie": _Menagerie(
        "pip install mujoco-menagerie, and its command to fetch the model"
    ),
    "robotiq_description": _Provider(
        "a folder with the meshes of the ROS package robotiq_description"
    ),
}


class _Piece(Posed):
    """One mesh file in a link's frame."""

    file: str = Field(min_length=1, max_length=300)
    color: Color = "grey"
    scale: Vector3 = (1.0, 1.0, 1.0)


class SkinTable(FrozenModel):
    """One file `robots/skin/NAME.toml`: for each link of component NAME its meshes."""

    format: Literal[1]
    provider: str
    folder: str = ""
    link: dict[Name, tuple[_Piece, ...]]


class Wardrobe:
    """Finds the meshes of components; tells once what is missing.

    Args:
        skin: `"meshes"` for those of installed packages, or a folder: meshes are then
            looked for there by path or, when only one fits, by name.
        catalogue: Where the tables are.

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
        self._missing: dict[str, list[str]] = {}
        self._found = False

    def dress(
        self, component: str, links: Iterable[str]
    ) -> dict[str, tuple[SkinMesh, ...]]:
        """Return the meshes of each link of a component; none if there are none.

        Args:
            component: The component's name.
            links: The links that it has.

        Raises:
            UnknownNameError: If the table names a link that the component lacks.
        """
        table = self._table(component)
        if table is None:
            return {}
        names = set(links)
        for name in table.link:
            if name not in names:
                raise UnknownNameError("link of a skin", name, names)
        files = {p.file: self._locate(table, p.file) for p in _pieces(table)}
        if None in files.values():
            self._missing.setdefault(table.provider, []).append(component)
            return {}
        self._found = True
        return {
            link: tuple(
                SkinMesh(
                    shape="skin",
                    file=str(files[piece.file]),
                    pos=piece.pos,
                    quat=piece.quat,
                    scale=piece.scale,
                    color=piece.color,
                )
                for piece in pieces
            )
            for link, pieces in table.link.items()
        }

    def report(self) -> None:
        """Warn of what stays undressed.

        Raises:
            ConfigError: If nothing at all was found.
        """
        where = f" below {self._folder}" if self._folder else ""
        lines = [
            f"the meshes of {', '.join(names)} were not found{where}; they come with: "
            f"{PROVIDERS[provider].install}"
            for provider, names in self._missing.items()
        ]
        if lines and not self._found:
            raise ConfigError(f"skin: {'; '.join(lines)}.")
        if not self._found:
            raise ConfigError("skin: no meshes are known for this robot.")
        for line in lines:
            log.warning("skin: %s", line)

    def _table(self, component: str) -> SkinTable | None:
        if not self._catalogue.holds("robots/skin", component):
            return None
        path = self._catalogue.find("robots/skin", component, kind="skin")
        return read_skin(path)

    def _locate(self, table: SkinTable, file: str) -> Path | None:
        inside = Path(table.folder) / file
        if self._folder is not None:
            return self._in_folder(inside)
        for folder in PROVIDERS[table.provider].folders():
            for path in (folder / inside, *folder.glob(_versioned(inside))):
                if path.is_file():
                    return path
        return None

    def _in_folder(self, file: Path) -> Path | None:
        """Find a file below the user's folder: the one that shares most of its path."""
        matches = self._by_name.get(file.name.casefold(), [])
        ranked = sorted(matches, key=lambda path: -_common_end(path, file))
        best = [
            p for p in ranked if _common_end(p, file) == _common_end(ranked[0], file)
        ]
        return best[0] if len(best) == 1 else None

    @cached_property
    def _by_name(self) -> dict[str, list[Path]]:
        found: dict[str, list[Path]] = {}
        assert self._folder is not None
        for path in sorted(self._folder.rglob("*")):
            if path.suffix.casefold() in (".obj", ".stl"):
                found.setdefault(path.name.casefold(), []).append(path)
        return found


def read_skin(path: Path) -> SkinTable:
    """Read a table of meshes.

    Raises:
        ConfigError: Names file, key, value and the rule.
        UnknownNameError: If the provider is unknown.
    """
    table = load_model(SkinTable, path)
    if table.provider not in PROVIDERS:
        raise UnknownNameError("provider of meshes", table.provider, PROVIDERS)
    return table


def _pieces(table: SkinTable) -> Iterator[_Piece]:
    for pieces in table.link.values():
        yield from pieces


def _versioned(path: Path) -> str:
    """Return the pattern of a path whose first folder carries a version: name-1a2b."""
    first, *rest = path.parts
    return "/".join((f"{first}-*", *rest))


def _common_end(one: Path, other: Path) -> int:
    count = 0
    for a, b in zip(reversed(one.parts), reversed(other.parts), strict=False):
        if a.casefold() != b.casefold():
            break
        count += 1
    return count
