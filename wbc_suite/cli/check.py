"""`wbc-suite check`: is this file right?"""

from pathlib import Path
from typing import Annotated

import typer

from wbc_suite.cli.options import CatalogueOption

__all__ = ["check_file"]


def check_file(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A .toml, .urdf or .xml file.")
    ],
    catalogue: CatalogueOption = None,
) -> None:
    """Check a file as loading would, build both engines' models, and say what it is.

    The first fault ends it with the file, the key, the value and the rule.
    """
    from wbc_suite.robot import load_robot

    robot = load_robot(f"{file}")
    simulated = robot.to_mjspec().compile()
    computed = robot.to_pinocchio()
    print(
        f"{file}: fine. Robot '{robot.name}': {len(robot.links)} links, "
        f"{robot.dof} dof, {robot.mass:.1f} kg, {robot.root.kind} root; "
        f"MuJoCo and Pinocchio models with nv = {simulated.nv} and {computed.nv}."
    )
