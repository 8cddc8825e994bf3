"""`wbc-suite view | render | export | describe-action`: commands about one robot."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from wbc_suite.cli import options
from wbc_suite.cli.output import print
from wbc_suite.errors import ConfigError

if TYPE_CHECKING:
    from wbc_suite.control import ActionSlice
    from wbc_suite.typing import Vector


def view(
    robot: options.RobotArgument,
    gripper: options.GripperOption = None,
    base: options.BaseOption = None,
    skin: options.SkinOption = None,
    mesh_root: options.MeshRootOption = None,
    host: options.HostOption = "127.0.0.1",
    port: options.PortOption = None,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Show a robot: joints, frames, collision shapes, centre of mass, inertia."""
    from wbc_suite.robot import load_robot
    from wbc_suite.viewers.page_server import PageServer
    from wbc_suite.viewers.robot_page import RobotPage

    chosen = options.chosen(gripper)
    description = load_robot(
        robot, gripper=chosen, base=base, skin=skin, mesh_root=mesh_root
    )
    page = RobotPage(description, PageServer(host, port))
    title = description.title or description.name
    options.serve_until_interrupted(page.site, title)


def render(
    robot: options.RobotArgument,
    *,
    output: Annotated[Path, typer.Option("--output", "-o", help="Picture to write.")],
    view: Annotated[
        Literal["three_quarter", "front", "side", "back"],
        typer.Option(help="Where the camera stands."),
    ] = "three_quarter",
    keyframe: Annotated[str, typer.Option(help="Posture of the robot.")] = "ready",
    width: Annotated[int, typer.Option(min=16, max=8192, help="Pixels.")] = 800,
    height: Annotated[int, typer.Option(min=16, max=8192, help="Pixels.")] = 800,
    gripper: options.GripperOption = None,
    base: options.BaseOption = None,
    skin: options.SkinOption = None,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Draw a robot in the studio, without a display."""
    from PIL import Image

    from wbc_suite.atomic_files import replace_file
    from wbc_suite.robot import load_robot
    from wbc_suite.viewers.offscreen import render_robot

    picture = render_robot(
        load_robot(robot, gripper=options.chosen(gripper), base=base, skin=skin),
        view=view,
        keyframe=keyframe,
        size=(width, height),
    )
    replace_file(output, Image.fromarray(picture).save)
    print(f"Wrote {output}.")


def export_robot(
    robot: options.RobotArgument,
    *,
    to: Annotated[
        Literal["mjcf", "urdf", "toml"] | None,
        typer.Option(help="Format of one file to write."),
    ] = None,
    reader: Annotated[
        Literal["pybullet", "ros2", "isaac", "drake", "pinocchio"] | None,
        typer.Option("--for", help="Reader to write a folder of files for."),
    ] = None,
    root: Annotated[
        Literal["none", "fixed", "planar", "floating"] | None,
        typer.Option(
            help="Joint between the world and a URDF's first link; 'none' leaves it to "
            "the reader. By default the robot's own, and with --for 'none' for free "
            "robots."
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="File to write, otherwise it is printed; with --for a folder, "
            "READER/ROBOT by default.",
        ),
    ] = None,
    mesh_root: options.MeshRootOption = None,
    strict: options.StrictOption = False,
    gripper: options.GripperOption = None,
    base: options.BaseOption = None,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Write a robot for other programs, or a URDF or MJCF file as a TOML to edit.

    --to writes one file. A URDF gets a folder of meshes beside it.

    --for writes all that one reader takes, and prints how to load it:

    pybullet: a URDF that states all masses

    pinocchio: URDF, and SRDF with postures, rotor inertias and pairs

    drake: a URDF with motors, gains, accelerations and collision filters

    ros2: a package with ros2_control, controllers and SRDF for MoveIt

    isaac: a URDF with cameras, and an MJCF that becomes USD

    For example:

    wbc-suite export G1 --to urdf --root none -o g1.urdf

    wbc-suite export Panda --for ros2 -o ws/src
    """
    from wbc_suite.atomic_files import write_bytes
    from wbc_suite.robot import load_robot

    if (to is None) == (reader is None):
        raise typer.BadParameter("give either --to FORMAT or --for READER.")
    if root is not None and to in ("mjcf", "toml"):
        raise ConfigError(
            f"--root is for URDF; with --to {to} there is none to choose."
        )
    description = load_robot(
        robot,
        gripper=options.chosen(gripper),
        base=base,
        mesh_root=mesh_root,
        strict=strict,
    )
    if reader is not None:
        from wbc_suite.robot.readers.export import export_for

        folder = output or Path(reader) / description.name
        hint = export_for(description, reader, folder, root=root)
        print(f"Wrote {folder}. To load it:\n{hint}")
        return
    given: dict[str, Any] = {"root": root} if root else {}
    write = getattr(description, f"to_{to}")
    if output is None:
        sys.stdout.write(write(**given) + "\n")  # as it is
        return
    if not output.parent.is_dir():
        raise ConfigError(f"'{output}' cannot be written: no folder '{output.parent}'.")
    if to == "urdf":
        given["mesh_dir"] = output.with_name(f"{output.stem}_meshes")
    text = write(**given)
    write_bytes(output, text.encode())
    print(f"Wrote {output} ({len(text) / 1000:.0f} kB).")


ZEROS = {
    "base": "stands still",
    "velocity": "stands still",
    "torque": "no torque but that against gravity",
    "gripper": "half closed",
    "stiffness": "limp: no stiffness",
    "damping": "no damping",
}
"""What zeros mean, by kind of slice; all other kinds hold or go to an origin."""


def describe_action(
    robot: options.RobotArgument,
    *,
    controller: Annotated[
        str | None,
        typer.Option(help="Controller, by name or file; by default the robot's own."),
    ] = None,
    benchmark: Annotated[str, typer.Option(help="Scene of the robot.")] = "Lift",
    as_json: options.JsonOption = False,
    gripper: options.GripperOption = None,
    base: options.BaseOption = None,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Show the slices of an action: names, indices, units, bounds, what zeros mean."""
    import wbc_suite

    built = wbc_suite.load_robot(robot, gripper=options.chosen(gripper), base=base)
    config = wbc_suite.load_composite_controller_config(controller, built)
    env = wbc_suite.make(benchmark, robots=built, controller_configs=config)
    env.reset(seed=0)
    held = env.action_layout.unpack(env.hold_action)
    if as_json:
        slices = [_slice(part, held[part.name]) for part in env.action_layout.slices]
        print(json.dumps({"controller": config["type"], "slices": slices}))
        env.close()
        return
    print(f"{config['type']}: {env.action_layout.size} values")
    print(env.action_layout)
    print("Zeros:")
    width = max((len(name) for name in held), default=0)
    for part in env.action_layout.slices:
        print(f"  {part.name.ljust(width)}  {_zeros(part, held[part.name])}")
    env.close()


def _slice(part: "ActionSlice", held: "Vector") -> dict[str, object]:
    """Return a slice as plain data; `held` are values that keep its goal."""
    return {
        "name": part.name,
        "kind": str(part.kind),
        "labels": list(part.labels),
        "units": [str(unit) for unit in part.units],
        "low": list(map(float, part.low)),
        "high": list(map(float, part.high)),
        "hold": held.tolist(),
        "zeros": _zeros(part, held),
    }


def _zeros(part: "ActionSlice", held: "Vector") -> str:
    """Return what zeros mean in a slice; `held` are values that keep its goal."""
    if part.name == "base_mode":
        return "goals of hands move with the base"
    if part.kind == "base" and len(held) == 3 and held.any():
        return "drive to the origin; hold_action holds"
    if part.kind in ZEROS:
        return ZEROS[part.kind]
    if not held.any():
        return "hold the present goal"
    places = {"posture": "all joints at 0", "orientation": "no turn from the origin's"}
    place = places.get(part.kind, "the origin")
    return f"go to {place}; hold_action holds"
