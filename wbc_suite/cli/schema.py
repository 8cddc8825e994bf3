"""`wbc-suite schema`: what an editor needs to help with robot files."""

import json
from typing import Annotated, Literal

import typer

__all__ = ["print_schema"]


def print_schema(
    kind: Annotated[
        Literal["component", "assembly"],
        typer.Argument(help="Kind of robot file."),
    ],
) -> None:
    """Print the JSON Schema of robot files, for completion in an editor."""
    from wbc_suite.robot.schema import robot_schema

    print(json.dumps(robot_schema(kind), indent=2))
