"""`wbc-suite export`: a robot as MJCF, URDF or our own TOML."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from wbc_suite.cli.options import (
    BaseOption,
    CatalogueOption,
    GripperOption,
    RobotArgument,
    chosen,
    writing,
)

__all__ = ["export_robot"]


class Format(StrEnum):
    """Formats that other programs read, and our own for editing an imported robot."""

    MJCF = "mjcf"
    URDF = "urdf"
    TOML = "toml"


def export_robot(
    robot: RobotArgument,
    *,
    to: Annotated[Format, typer.Option(help="Format to write.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="File to write; otherwise it is printed."),
    ] = None,
    mend_inertias: Annotated[
        bool,
        typer.Option(help="Replace inertias that no body has (of a URDF file)."),
    ] = False,
    gripper: GripperOption = None,
    base: BaseOption = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Write a robot for other programs, or a URDF or MJCF file as a TOML to edit."""
    from wbc_suite.robot import load_robot
    from wbc_suite.robot.urdf_import import read_urdf

    if mend_inertias and robot.endswith(".urdf"):
        description = read_urdf(robot, mend_inertias=True)
    else:
        description = load_robot(robot, gripper=chosen(gripper), base=base)
    text = {
        Format.MJCF: description.to_mjcf,
        Format.URDF: description.to_urdf,
        Format.TOML: description.to_toml,
    }[to]()
    if output is None:
        print(text)
        return
    with writing(output):
        output.write_text(text, encoding="utf-8")
    print(f"Wrote {output} ({len(text) / 1000:.0f} kB).")
