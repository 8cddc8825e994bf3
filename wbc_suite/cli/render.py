"""`wbc-suite render`: a picture of a robot."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from wbc_suite.cli.options import (
    BaseOption,
    CatalogueOption,
    GripperOption,
    RobotArgument,
    SkinOption,
    chosen,
    writing,
)

__all__ = ["render"]


class ViewChoice(StrEnum):
    """Where the camera stands."""

    THREE_QUARTER = "three_quarter"
    FRONT = "front"
    SIDE = "side"
    BACK = "back"


def render(
    robot: RobotArgument,
    *,
    output: Annotated[Path, typer.Option("--output", "-o", help="Picture to write.")],
    view: Annotated[
        ViewChoice, typer.Option(help="Where the camera stands.")
    ] = ViewChoice.THREE_QUARTER,
    keyframe: Annotated[str, typer.Option(help="Posture of the robot.")] = "ready",
    width: Annotated[int, typer.Option(min=16, max=8192, help="Pixels.")] = 800,
    height: Annotated[int, typer.Option(min=16, max=8192, help="Pixels.")] = 800,
    gripper: GripperOption = None,
    base: BaseOption = None,
    skin: SkinOption = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Draw a robot in the studio, without a display."""
    from PIL import Image

    from wbc_suite.robot import load_robot
    from wbc_suite.viewers.offscreen import render_robot

    picture = render_robot(
        load_robot(robot, gripper=chosen(gripper), base=base, skin=skin),
        view=view.value,
        keyframe=keyframe,
        size=(width, height),
    )
    with writing(output):
        Image.fromarray(picture).save(output)
    print(f"Wrote {output}.")
