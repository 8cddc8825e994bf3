"""Options that several commands share."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from wbc_suite.catalogue import ENVIRONMENT_VARIABLE
from wbc_suite.errors import ConfigError

__all__ = ["CatalogueOption", "RobotArgument", "SkinOption", "writing"]


def _add_to_catalogue(folders: list[Path] | None) -> list[Path]:
    """Let every `Catalogue()` of this process see the folders."""
    added = [str(folder) for folder in folders or []]
    known = os.environ.get(ENVIRONMENT_VARIABLE, "")
    if added:
        os.environ[ENVIRONMENT_VARIABLE] = os.pathsep.join([known, *added]).strip(
            os.pathsep
        )
    return folders or []


CatalogueOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--catalogue",
        metavar="DIR",
        help="Further folder with robots/, tasks/, controllers/; may be repeated.",
        callback=_add_to_catalogue,
    ),
]

RobotArgument = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT", help="Name (`wbc-suite list`) or a .toml, .urdf or .xml file."
    ),
]

SkinOption = Annotated[
    str | None,
    typer.Option(
        metavar="meshes|DIR",
        help="Draw with real meshes, from installed packages or from a folder.",
    ),
]


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn what can go wrong with an output file into one line that names it."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise ConfigError(f"'{path}' cannot be written: {error}.") from error
