"""`wbc-suite export`: a robot as MJCF or URDF text."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from wbc_suite.cli.options import CatalogueOption, RobotArgument, writing

__all__ = ["export_robot"]


class Format(StrEnum):
    """Formats that other programs read."""

    MJCF = "mjcf"
    URDF = "urdf"


def export_robot(
    robot: RobotArgument,
    *,
    to: Annotated[Format, typer.Option(help="Format to write.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="File to write; otherwise it is printed."),
    ] = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Write a robot for other programs."""
    from wbc_suite.robot import load_robot

    description = load_robot(robot)
    text = description.to_mjcf() if to is Format.MJCF else description.to_urdf()
    if output is None:
        print(text)
        return
    with writing(output):
        output.write_text(text, encoding="utf-8")
    print(f"Wrote {output} ({len(text) / 1000:.0f} kB).")
