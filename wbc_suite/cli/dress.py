"""`wbc-suite dress`: draw robots with meshes of packages, and check how they fit."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wbc_suite.cli import options
from wbc_suite.cli.output import print
from wbc_suite.errors import ConfigError, WbcError

if TYPE_CHECKING:
    from wbc_suite.robot import RobotDescription

FITS = 0.93
"""Least overlap of silhouettes of meshes and of our shapes that counts as a fit."""
CELL = 320  # width and height of a picture, pixels


def dress(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[ROBOT]...", help="Robots; all by default."),
    ] = None,
    skin: Annotated[
        str,
        typer.Option(
            metavar="meshes|DIR|FILE",
            help="Installed packages, a folder, or a URDF or MJCF file of the robot.",
        ),
    ] = "meshes",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Picture of both drawings to write."),
    ] = None,
    as_json: options.JsonOption = False,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Draw robots with real meshes, and compare silhouettes with their own shapes.

    The meshes are those of installed packages; where there are none, the command that
    installs them is printed. Decimated meshes are kept for `--skin` of other commands.
    """
    from wbc_suite.catalogue import Catalogue

    rows: list[dict[str, Any]] = []
    pictures: list[Any] = []
    for name in names or Catalogue().called("robots"):
        row, pair = _dressed(name, skin, pictures=output is not None)
        rows.append(row)
        pictures += pair
        if not as_json:
            print(_line(row))
    if as_json:
        print(json.dumps(rows, indent=1))
    if output is not None:
        _write(output, pictures)
        if not as_json:
            print(f"Wrote {output}.")
    if not any(row["overlap"] for row in rows):
        raise typer.Exit(1)


def _dressed(
    name: str, skin: str, *, pictures: bool
) -> tuple[dict[str, Any], list[Any]]:
    """Return what is said of a robot, and pictures of it without and with meshes."""
    from wbc_suite.robot import load_robot
    from wbc_suite.robot.shapes import SkinMesh
    from wbc_suite.robot.skins import package_of
    from wbc_suite.viewers.offscreen import render_robot
    from wbc_suite.viewers.silhouettes import overlap

    plain = load_robot(name, skin="none")
    row: dict[str, Any] = {"robot": plain.name, "packages": [], "overlap": {}}
    try:
        robot = load_robot(name, skin=skin)
    except ConfigError as error:
        return row | {"missing": str(error)}, []
    meshes = [s for drawn in robot.skins.values() for s in drawn]
    files = {mesh.file for mesh in meshes if isinstance(mesh, SkinMesh)}
    row["packages"] = sorted({package_of(file) for file in files})
    row["links"] = len(robot.skins)
    row["plain"] = [link.name for link in robot.links if _is_plain(robot, link.name)]
    row["overlap"] = overlap(plain, robot)
    sizes = (CELL, CELL)
    pair = [render_robot(r, size=sizes) for r in (plain, robot)] if pictures else []
    return row, [(f"{plain.name} {min(row['overlap'].values()):.3f}", pair)]


def _is_plain(robot: "RobotDescription", link: str) -> bool:
    return link not in robot.skins and bool(robot.link(link).visual)


def _line(row: dict[str, Any]) -> str:
    if not row["overlap"]:
        return f"{row['robot']}: {row['missing']}"
    least = min(row["overlap"].values())
    fits = "fits" if least >= FITS else "differs"
    left = len(row["plain"])
    rest = f", {left} links in their own shapes" if left else ""
    return (
        f"{row['robot']}: {row['links']} links of {', '.join(row['packages'])}{rest}; "
        f"overlap of silhouettes {least:.3f}, {fits}"
    )


def _write(output: Path, pictures: list[Any]) -> None:
    """Write pairs of pictures with their titles, four pairs in a row."""
    from PIL import Image, ImageDraw

    from wbc_suite.atomic_files import replace_file

    pairs = [item for item in pictures if item[1]]
    if not pairs:
        raise WbcError("No robot has meshes: no picture is written.")
    columns = min(4, len(pairs))
    rows = -(-len(pairs) // columns)
    sheet = Image.new("RGB", (2 * CELL * columns, CELL * rows))
    for k, (title, pair) in enumerate(pairs):
        x, y = 2 * CELL * (k % columns), CELL * (k // columns)
        for side, picture in enumerate(pair):
            sheet.paste(Image.fromarray(picture), (x + CELL * side, y))
        ImageDraw.Draw(sheet).text((x + 8, y + 8), title, fill="black", font_size=18)
    replace_file(output, sheet.save)
