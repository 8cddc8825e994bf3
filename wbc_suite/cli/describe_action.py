"""`wbc-suite describe-action`: what the numbers of an action mean."""

from typing import TYPE_CHECKING, Annotated

import typer

from wbc_suite.cli.options import (
    BaseOption,
    CatalogueOption,
    GripperOption,
    RobotArgument,
    chosen,
)

if TYPE_CHECKING:
    from wbc_suite.control import ActionSlice
    from wbc_suite.typing import Vector

__all__ = ["describe_action"]

ZEROS = {
    "base": "stands still",
    "velocity": "stands still",
    "torque": "only its own weight is carried",
    "gripper": "half closed",
    "stiffness": "limp: no stiffness",
    "damping": "no damping",
}
"""What zeros mean, by kind of slice; all other kinds hold or go to an origin."""


def describe_action(
    robot: RobotArgument,
    *,
    controller: Annotated[
        str | None,
        typer.Option(help="Name or file of a controller; else the robot's usual one."),
    ] = None,
    benchmark: Annotated[str, typer.Option(help="Where the robot stands.")] = "Lift",
    gripper: GripperOption = None,
    base: BaseOption = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Show the slices of an action: names, places, units, bounds, and what 0 means."""
    import wbc_suite

    built = wbc_suite.load_robot(robot, gripper=chosen(gripper), base=base)
    config = wbc_suite.load_composite_controller_config(controller, built)
    env = wbc_suite.make(benchmark, robots=built, controller_configs=config)
    env.reset(seed=0)
    held = env.action_layout.unpack(env.hold_action)
    print(f"{config['type']}: {env.action_layout.size} values")
    print(env.action_layout)
    print("Zeros:")
    width = max((len(name) for name in held), default=0)
    for part in env.action_layout.slices:
        print(f"  {part.name.ljust(width)}  {_zeros(part, held[part.name])}")
    env.close()


def _zeros(part: "ActionSlice", held: "Vector") -> str:
    """Return what zeros mean in a slice.

    Args:
        part: The slice.
        held: Its values that keep the present goal.
    """
    if part.name == "base_mode":
        return "goals of hands ride on the base"
    if part.kind == "base" and len(held) == 3 and held.any():
        return "go to the origin; hold_action stays"
    if part.kind in ZEROS:
        return ZEROS[part.kind]
    if not held.any():
        return "hold the present goal"
    places = {"posture": "all joints at 0", "orientation": "no turn from the origin's"}
    place = places.get(part.kind, "the origin")
    return f"go to {place}; hold_action holds"
