"""Skins: meshes of other packages, drawn instead of a robot's own visual shapes.

A table `robots/skin/NAME.toml` names model files of public packages that component NAME
is dressed by, see `robot.dressing`, or lists mesh files for each of its links. They are
found in an installed package, which is not imported, or in a folder of the user.
Physics does not change.
"""

import importlib.util
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Literal

from pydantic import Field

from wbc_suite import logs
from wbc_suite.catalogue import Catalogue, user_cache_root
from wbc_suite.config_files import FrozenModel, load_model
from wbc_suite.errors import ConfigError, UnknownNameError, WbcError, look_up
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.dressing import dress
from wbc_suite.robot.elements import Name
from wbc_suite.robot.mesh_files import MeshIndex
from wbc_suite.robot.shapes import Color, Drawn, Posed, SkinMesh, Vector3

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
    "robosuite_models": (
        "pip install --no-deps robosuite-models",
        lambda: _module("robosuite_models"),
    ),
    "mjlab": ("pip install --no-deps mjlab", lambda: _module("mjlab")),
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


class _Model(FrozenModel):
    """A URDF or MJCF file of a package; some of its links are not drawn."""

    provider: str
    file: str = Field(min_length=1, max_length=300)
    without: tuple[str, ...] = ()


class SkinTable(FrozenModel):
    """One file `robots/skin/NAME.toml`: what component NAME is drawn with.

    Attributes:
        provider: The package with the mesh files of `link`.
        folder: The folder there that their names start from.
        link: Mesh files of each link.
        model: Models that have meshes for it; the first that is found is taken, if the
            files of `link` are not.
    """

    format: Literal[1]
    provider: str = ""
    folder: str = ""
    link: dict[Name, tuple[_Piece, ...]] = {}
    model: tuple[_Model, ...] = ()

    @property
    def providers(self) -> tuple[str, ...]:
        """Return the packages that have meshes for the component."""
        own = (self.provider,) if self.link else ()
        return tuple(dict.fromkeys((*own, *(m.provider for m in self.model))))


class SkinFinder:
    """Finds the meshes of components and reports missing ones once.

    The skin "meshes" are those of installed packages; in a folder meshes are looked up
    by path or, if only one file matches, by name.

    Attributes:
        found: The package, or folder, of each component that has meshes.
        missing: The packages that have meshes for the other components.

    Raises:
        ConfigError: If the folder does not exist.
    """

    def __init__(self, skin: str | Path, catalogue: Catalogue) -> None:
        self._catalogue = catalogue
        self._folder = None if str(skin) == MESHES else Path(skin).expanduser()
        if self._folder is not None and not self._folder.is_dir():
            raise ConfigError(
                f"skin: '{skin}' is neither '{MESHES}', nor a folder with meshes, nor "
                "a URDF or MJCF file."
            )
        self._index = None if self._folder is None else MeshIndex(self._folder)
        self.found: dict[str, str] = {}
        self.missing: dict[str, tuple[str, ...]] = {}

    def meshes(
        self, component: str, robot: RobotDescription
    ) -> dict[str, tuple[Drawn, ...]]:
        """Return what draws each link of a component; empty without a skin."""
        if not self._catalogue.holds("robots/skin", component):
            return {}
        table = read_skin(self._catalogue.find("robots/skin", component, kind="skin"))
        drawn = self._pieces(table, robot)
        provider = table.provider
        for model in table.model:
            path = None if drawn else self._locate(model.provider, model.file)
            if path is None:
                continue
            try:
                drawn = dress(robot, read_model(path), model.without)
            except WbcError as error:  # of another version of the package
                log.warning("skin: %s", error)
            provider = model.provider
        if drawn:
            self.found[component] = provider
        else:
            self.missing[component] = table.providers
        return drawn

    def report_missing(self) -> None:
        """Log a warning about missing meshes; raises ConfigError if none was found."""
        where = f" below {self._folder}" if self._folder else ""
        asked: dict[tuple[str, ...], list[str]] = {}
        for component, providers in self.missing.items():
            asked.setdefault(providers, []).append(component)
        lines = [
            f"the meshes of {', '.join(names)} were not found{where}. To install "
            f"them: {how_to_install(providers)}"
            for providers, names in asked.items()
        ]
        if lines and not self.found:
            raise ConfigError(f"skin: {'; '.join(lines)}.")
        if not self.found:
            raise ConfigError("skin: there are no meshes for this robot.")
        for line in lines:
            log.warning("skin: %s", line)

    def _pieces(
        self, table: SkinTable, robot: RobotDescription
    ) -> dict[str, tuple[Drawn, ...]]:
        """Return the mesh files of a table; empty if one is missing."""
        names = {link.name for link in robot.links}
        for name in table.link:
            if name not in names:
                raise UnknownNameError("link of a skin", name, names)
        drawn: dict[str, tuple[Drawn, ...]] = {}
        for link, pieces in table.link.items():
            own: list[SkinMesh] = []
            for piece in pieces:
                path = self._locate(table.provider, f"{table.folder}/{piece.file}")
                if path is None:
                    return {}
                fields = {"shape": "skin", "file": str(path)}
                own.append(SkinMesh.model_validate(piece.model_dump() | fields))
            drawn[link] = tuple(own)
        return drawn

    def _locate(self, provider: str, file: str) -> Path | None:
        inside = Path(file.removeprefix("/"))
        if self._index is not None:
            return self._index.find(inside)
        first, *rest = inside.parts
        versioned = "/".join((f"{first}-*", *rest))  # the folder name-1a2b of a version
        for folder in PROVIDERS[provider][1]():
            for path in (folder / inside, *folder.glob(versioned)):
                if path.is_file():
                    return path
        return None


def how_to_install(providers: Iterable[str]) -> str:
    """Return the commands that install packages with meshes."""
    return ", or ".join(PROVIDERS[provider][0] for provider in providers)


def package_of(file: str) -> str:
    """Return the package that a mesh or model file is of, or else its folder."""
    path = Path(file)
    for name, (_, folders) in PROVIDERS.items():
        if any(path.is_relative_to(folder) for folder in folders()):
            return name
    return str(path.parent)


def read_skin(path: Path) -> SkinTable:
    """Read a table of meshes; raises ConfigError or UnknownNameError."""
    table = load_model(SkinTable, path)
    for provider in table.providers:
        look_up("provider of meshes", provider, PROVIDERS)
    if not table.providers:
        raise ConfigError(f"{path}: it has neither [link] nor [[model]].")
    return table


def read_model(path: Path) -> RobotDescription:
    """Read what a URDF or MJCF file draws, without notes about the rest of it."""
    return _read_model(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _read_model(path: Path, _changed: int) -> RobotDescription:
    from wbc_suite.robot.mjcf_import import read_mjcf
    from wbc_suite.robot.urdf_import import read_urdf

    read = read_urdf if path.suffix.lower() == ".urdf" else read_mjcf
    with logs.quiet("wbc_suite.robot"):
        return read(path, contacts=False)
