"""Options that several commands share."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from wbc_suite.catalogue import ENVIRONMENT_VARIABLE
from wbc_suite.errors import ConfigError

__all__ = [
    "BaseOption",
    "CatalogueOption",
    "GripperOption",
    "RobotArgument",
    "SkinOption",
    "chosen",
    "writing",
]


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

GripperOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Another gripper; one for each side: right=NAME,left=NAME; or none.",
    ),
]

BaseOption = Annotated[
    str | None, typer.Option(metavar="NAME", help="Another base, or none.")
]

SkinOption = Annotated[
    str | None,
    typer.Option(
        metavar="meshes|DIR",
        help="Draw with real meshes, from installed packages or from a folder.",
    ),
]


def chosen(gripper: str | None) -> str | dict[str, str] | None:
    """Return what `--gripper` says: one for all sides, or one for each."""
    if gripper is None or "=" not in gripper:
        return gripper
    return {
        side.strip(): name.strip()
        for side, _, name in (part.partition("=") for part in gripper.split(","))
    }


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn what can go wrong with an output file into one line that names it."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise ConfigError(f"'{path}' cannot be written: {error}.") from error
