"""`wbc-suite schema`: what editors and senders of frames need to know."""

import json
from typing import Annotated, Literal

import typer

__all__ = ["print_schema"]


def print_schema(
    kind: Annotated[
        Literal["component", "assembly", "frame"],
        typer.Argument(help="Kind of robot file, or a stream's pose frame."),
    ],
) -> None:
    """Print the JSON Schema of robot files, or of the frames that a stream takes."""
    if kind == "frame":
        from wbc_suite.devices.frame import frame_schema

        print(json.dumps(frame_schema(), indent=2))
        return
    from wbc_suite.robot.schema import robot_schema

    print(json.dumps(robot_schema(kind), indent=2))
