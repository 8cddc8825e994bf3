"""Options that several commands share."""

import os
import tomllib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from wbc_suite.catalogue import ENVIRONMENT_VARIABLE
from wbc_suite.errors import ConfigError

__all__ = [
    "BaseOption",
    "CatalogueOption",
    "ExecutorOption",
    "GripperOption",
    "RobotArgument",
    "SkinOption",
    "chosen",
    "device_options",
    "progress",
    "tracked",
    "writing",
]


T = TypeVar("T")


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

ExecutorOption = Annotated[
    str, typer.Option(metavar="NAME", help="process, serial, ray or slurm.")
]

SkinOption = Annotated[
    str | None,
    typer.Option(
        metavar="meshes|DIR",
        help="Draw with real meshes, from installed packages or from a folder.",
    ),
]

DeviceOptions = Annotated[
    list[str] | None,
    typer.Option(
        "--device-option",
        metavar="NAME=VALUE",
        help="Option of the device; may be repeated.",
    ),
]

ScaleOption = Annotated[
    float, typer.Option(help="Motion of a hand per motion of the device.", min=0.01)
]

MirrorOption = Annotated[
    bool, typer.Option("--mirror", help="Face the robot: swap left and right.")
]


def chosen(gripper: str | None) -> str | dict[str, str] | None:
    """Return what `--gripper` says: one for all sides, or one for each."""
    if gripper is None or "=" not in gripper:
        return gripper
    return {
        side.strip(): name.strip()
        for side, _, name in (part.partition("=") for part in gripper.split(","))
    }


def device_options(pairs: list[str] | None) -> dict[str, object]:
    """Return what `--device-option NAME=VALUE` says.

    Values are read as TOML (`8091`, `true`, `["right", "left"]`), else they are text.

    Raises:
        ConfigError: If there is no `=`.
    """
    options: dict[str, object] = {}
    for pair in pairs or []:
        name, equals, value = pair.partition("=")
        if not equals:
            raise ConfigError(f"--device-option {pair}: write NAME=VALUE.")
        try:
            options[name] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            options[name] = value
    return options


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn what can go wrong with an output file into one line that names it."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise ConfigError(f"'{path}' cannot be written: {error}.") from error


@contextmanager
def progress(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show a bar on the error output where that is a terminal; call to advance it."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    columns = (title, BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        line = bar.add_task(title, total=total)
        yield lambda done: bar.advance(line, done)


def tracked(items: Sequence[T], title: str) -> Iterator[T]:
    """Hand out items one by one, and show how many have been dealt with."""
    with progress(title, len(items)) as advance:
        for item in items:
            yield item
            advance(1)
