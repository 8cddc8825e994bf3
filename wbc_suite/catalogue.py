"""Find the catalogue: the folders `robots/`, `tasks/` and `controllers/` of TOML files.

An installed wheel carries them as `wbc_suite/_catalogue/`; in a checkout they lie at
the top of the repository. A laboratory adds a folder of its own of the same shape with
`Catalogue(extra=[...])`, with `--catalogue DIR` on the command line, or by setting
`WBC_SUITE_CATALOGUE`; its files win over ours.
"""

import os
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from wbc_suite.errors import ConfigError, UnknownNameError

__all__ = ["Catalogue"]

ENVIRONMENT_VARIABLE = "WBC_SUITE_CATALOGUE"


def _default_root() -> Path:
    package = Path(__file__).resolve().parent
    installed = package / "_catalogue"
    return installed if installed.is_dir() else package.parent


def _default_extra() -> tuple[Path, ...]:
    value = os.environ.get(ENVIRONMENT_VARIABLE, "")
    return tuple(Path(p) for p in value.split(os.pathsep) if p)


def _key(name: str) -> str:
    """Fold a name so that `SpotWithArm`, `spot_with_arm` and `spotwitharm` agree."""
    return name.casefold().replace("_", "").replace("-", "")


def _own_name(path: Path) -> str:
    try:
        content = tomllib.loads(path.read_text("utf-8"))
    except (OSError, ValueError):
        return path.stem  # the error is about another name than this one
    headers = (content, *map(content.get, ("assembly", "component")))
    names = (header.get("name") for header in headers if isinstance(header, dict))
    return next((name for name in names if isinstance(name, str)), path.stem)


@dataclass(frozen=True, kw_only=True, slots=True)
class Catalogue:
    """A set of folders of one shape, searched from the last to the first.

    Attributes:
        root: The folder that holds `robots/`, `tasks/` and `controllers/`.
        extra: Further folders of the same shape; a later one wins.
    """

    root: Path = field(default_factory=_default_root)
    extra: tuple[Path, ...] = field(default_factory=_default_extra)

    def __post_init__(self) -> None:
        if isinstance(self.extra, str | Path) or not isinstance(self.extra, Iterable):
            raise ConfigError(
                f"Catalogue: extra is a list of folders, not {self.extra!r:.60}."
            )
        for folder in (self.root, *self.extra):
            if not isinstance(folder, str | Path) or not Path(folder).is_dir():
                raise ConfigError(f"Catalogue folder '{folder!s:.80}' does not exist.")

    def names(self, folder: str) -> tuple[str, ...]:
        """Return the sorted file stems under a folder such as `robots/gripper`."""
        return tuple(sorted({p.stem for p in self._files(folder)}))

    def files(self, folder: str) -> tuple[Path, ...]:
        """Return the files that `names` names, in the same order."""
        found = {p.stem: p for p in self._files(folder)}
        return tuple(found[name] for name in self.names(folder))

    def called(self, folder: str) -> tuple[str, ...]:
        """Return what files call themselves, such as `Robotiq85Gripper`, as `names`.

        A file that says no name, or cannot be read, is called by its stem.
        """
        return tuple(_own_name(path) for path in self.files(folder))

    def holds(self, folder: str, name: str) -> bool:
        """Whether a folder has a file of a name, as `find` looks for it."""
        return _key(name) in map(_key, self.names(folder))

    def find(
        self, folder: str, name: str, *, kind: str, side: str | None = None
    ) -> Path:
        """Return the file of a name, without regard to case and underscores.

        Args:
            folder: Folder relative to a root, such as `robots` or `robots/arm`.
            name: Name to look up.
            kind: What the name is, for the error: "robot", "gripper".
            side: The side of a pair of files that a name without side stands for:
                `InspireHand` is `inspire_right_hand` on the right.

        Raises:
            UnknownNameError: If no root has such a file.
        """
        if ".." in Path(str(folder)).parts:
            raise ConfigError(f"'{folder}/{name}' leaves the catalogue.")
        found = {_key(p.stem): p for p in self._files(folder)}
        wanted = _key(str(name))
        path = found.get(wanted)
        if path is None and side is not None:
            paired = (p for k, p in found.items() if k.replace(side, "", 1) == wanted)
            path = next(paired, None)
        if path is None:
            raise UnknownNameError(kind, name, self.called(folder))
        return path

    def is_ours(self, file: Path) -> bool:
        """Whether a file came with this package, or from one of the extra folders."""
        return file.is_relative_to(self.root)

    def _files(self, folder: str) -> Iterable[Path]:
        for root in (self.root, *self.extra):
            yield from sorted((Path(root) / str(folder)).glob("*.toml"))
