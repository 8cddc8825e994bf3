"""Find the package's folders: the catalogue of TOML files, and the user's cache.

The catalogue has the folders `robots/`, `tasks/` and `controllers/`. An installed wheel
holds it as `wbc_suite/_catalogue/`, a checkout at the top of the repository. Users add
a folder with the same layout by `Catalogue(extra=[...])`, `--catalogue DIR` on the
command line or the variable `WBC_SUITE_CATALOGUE`; its files take precedence.
"""

import os
import tempfile
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.files import read_text

ENVIRONMENT_VARIABLE = "WBC_SUITE_CATALOGUE"


def user_cache_root() -> Path:
    """Return the user's cache folder, shared by all programs.

    A user without a home has a folder for temporary files in its place.
    """
    if folder := os.environ.get("XDG_CACHE_HOME"):
        return Path(folder)
    try:
        return Path.home() / ".cache"
    except RuntimeError:  # neither HOME nor an entry in passwd
        return temporary_root()


def temporary_root() -> Path:
    """Return this user's own folder among temporary files; it may not exist yet."""
    return Path(tempfile.gettempdir()) / f"wbc_suite-{os.getuid()}"


def user_cache() -> Path:
    """Return this package's folder in the user's cache; it may not exist yet."""
    return user_cache_root() / "wbc_suite"


def user_config() -> Path:
    """Return this package's folder in the user's configuration; it may not exist."""
    folder = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(folder) / "wbc_suite"


def _default_root() -> Path:
    package = Path(__file__).resolve().parent
    installed = package / "_catalogue"
    return installed if installed.is_dir() else package.parent


def _default_extra() -> tuple[Path, ...]:
    value = os.environ.get(ENVIRONMENT_VARIABLE, "")
    return tuple(Path(p) for p in value.split(os.pathsep) if p)


def name_key(name: str) -> str:
    """Normalise a name: `SpotWithArm`, `spot_with_arm` and `spotwitharm` are equal."""
    return name.casefold().replace("_", "").replace("-", "")


def merge(base: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a file over that which it extends.

    Tables are merged key by key, also within tables; one of another `type`, and every
    other value, such as a list, replaces that of the base.
    """
    merged = dict(base)
    for key, value in own.items():
        below = merged.get(key)
        if isinstance(value, Mapping) and isinstance(below, Mapping):
            same = value.get("type", below.get("type")) == below.get("type")
            merged[key] = merge(below, value) if same else value
        else:
            merged[key] = value
    return merged


def _own_name(path: Path) -> str:
    """Return the name that a file declares, or its stem."""
    try:
        return _declared_name(read_text(path)) or path.stem
    except (ConfigError, ValueError, RecursionError):
        return path.stem  # listing names must not fail because of one file


@lru_cache(maxsize=512)
def _declared_name(text: str) -> str | None:
    content = tomllib.loads(text)
    headers = (content, *map(content.get, ("assembly", "component")))
    names = (header.get("name") for header in headers if isinstance(header, dict))
    return next((name for name in names if isinstance(name, str)), None)


@dataclass(frozen=True, kw_only=True, slots=True)
class Catalogue:
    """Folders with `robots/`, `tasks/`, `controllers/`; later ones take precedence."""

    root: Path = field(default_factory=_default_root)
    extra: tuple[Path, ...] = field(default_factory=_default_extra)

    def __post_init__(self) -> None:
        if isinstance(self.extra, str | Path) or not isinstance(self.extra, Iterable):
            raise ConfigError(
                f"Catalogue: 'extra' must be a list of folders, not {self.extra!r:.60}."
            )
        for folder in (self.root, *self.extra):
            if not isinstance(folder, str | Path) or not Path(folder).is_dir():
                raise ConfigError(f"Catalogue folder '{folder!s:.80}' does not exist.")

    def names(self, folder: str) -> tuple[str, ...]:
        """Return the sorted file stems under a folder such as `robots/gripper`."""
        return tuple(path.stem for path in self.files(folder))

    def files(self, folder: str) -> tuple[Path, ...]:
        """Return the files of `names`, in the same order."""
        found = {path.stem: path for path in self._files(folder)}
        return tuple(found[name] for name in sorted(found))

    def called(self, folder: str) -> tuple[str, ...]:
        """Return the names that files declare, such as `Robotiq85Gripper`.

        A file without a name, or one that cannot be read, is listed by its stem.
        """
        return tuple(_own_name(path) for path in self.files(folder))

    def holds(self, folder: str, name: str) -> bool:
        """Whether a file has this name."""
        return name_key(name) in map(name_key, self.names(folder))

    def find(
        self, folder: str, name: str, *, kind: str, side: str | None = None
    ) -> Path:
        """Return the file with a name, ignoring case and underscores.

        It is that of the file, or else the one that it declares.

        A side is inserted into a name that lacks it: on the right, `InspireHand` is the
        file `inspire_right_hand`.

        Raises:
            UnknownNameError: If no folder has such a file; names the kind of item.
            ConfigError: If the folder leads out of the catalogue.
        """
        if ".." in Path(str(folder)).parts:
            raise ConfigError(f"'{folder}/{name}' lies outside the catalogue.")
        found = {name_key(p.stem): p for p in self._files(folder)}
        wanted = name_key(str(name))
        path = found.get(wanted)
        if path is None and side is not None:
            paired = (p for k, p in found.items() if k.replace(side, "", 1) == wanted)
            path = next(paired, None)
        if path is None:
            named = {name_key(_own_name(file)): file for file in found.values()}
            path = named.get(wanted)
        if path is None:
            raise UnknownNameError(kind, name, self.called(folder))
        return path

    def chain(
        self,
        folder: str,
        path: Path,
        *,
        kind: str,
        base_of: Callable[[Path], str | None],
        key: str = "extends",
    ) -> list[Path]:
        """Return a file, the file that it extends, the one that this extends, ...

        A base lies beside its file or in the catalogue. A file may extend one of its
        own name, that over which it takes precedence.

        Args:
            folder: Folder of the catalogue, such as `tasks`.
            path: The file.
            kind: What a file is called in messages.
            base_of: Returns the name of a file's base, None for a file without.
            key: Where a file has that name.

        Raises:
            ConfigError: If there is no base of a name, or a file extends itself.
        """
        from wbc_suite.config_files import located  # not at the top: pydantic is slow

        chain = [path]
        while (name := base_of(chain[-1])) is not None:
            seen = {file.resolve() for file in chain}
            files = [*self._files(folder), *sorted(chain[-1].parent.glob("*.toml"))]
            new = {name_key(f.stem): f for f in files if f.resolve() not in seen}
            if name_key(name) in new:
                chain.append(new[name_key(name)])
                continue
            fault = str(UnknownNameError(kind, name, {f.stem for f in new.values()}))
            if name_key(name) in (name_key(file.stem) for file in chain):
                fault = "the files form a loop."
            where = located(key, str(chain[-1]))
            raise ConfigError(f"{chain[-1]}: {where} = '{name}': {fault}")
        return chain

    def is_ours(self, file: Path) -> bool:
        """Whether a file came with this package and not from an extra folder."""
        return file.is_relative_to(self.root)

    def _files(self, folder: str) -> Iterable[Path]:
        for root in (self.root, *self.extra):
            yield from sorted((Path(root) / str(folder)).glob("*.toml"))
