"""`wbc-suite describe-action`: what the numbers of an action mean."""

from typing import Annotated

import typer

from wbc_suite.cli.options import (
    BaseOption,
    CatalogueOption,
    GripperOption,
    RobotArgument,
    chosen,
)

__all__ = ["describe_action"]


def describe_action(
    robot: RobotArgument,
    *,
    controller: Annotated[
        str, typer.Option(help="Name or file of a controller.")
    ] = "WHOLE_BODY_IK",
    benchmark: Annotated[str, typer.Option(help="Where the robot stands.")] = "Lift",
    gripper: GripperOption = None,
    base: BaseOption = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Show the slices of an action: names, places, units and bounds."""
    import wbc_suite

    env = wbc_suite.make(
        benchmark,
        robots=robot,
        controller_configs=controller,
        gripper_types=chosen(gripper),
        base_types=base,
    )
    print(env.action_layout)
    env.close()
