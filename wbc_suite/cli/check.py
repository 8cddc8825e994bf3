"""`wbc-suite check`: is this file right?"""

from pathlib import Path
from typing import Annotated

import typer

from wbc_suite.cli.options import CatalogueOption

__all__ = ["check_file"]


def check_file(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A .toml, .json, .urdf or .xml file.")
    ],
    robot: Annotated[
        str | None,
        typer.Option(metavar="ROBOT", help="Check a controller's names against it."),
    ] = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Check a robot, benchmark or controller file, and say what it is.

    It is read as loading would read it, and a robot's models are built for both
    engines. The first fault ends it with the file, the key, the value and the rule.
    A JSON file is a controller of this field, which needs its robot.
    """
    from wbc_suite.tomlfile import read_toml

    content = read_toml(file) if file.suffix == ".toml" else {"component": None}
    controls = "body_parts" in content or "frame" in content
    if "name" in content:
        print(f"{file}: fine. {_benchmark(file)}")
    elif file.suffix == ".json" or (controls and "component" not in content):
        print(f"{file}: fine. {_controller(file, robot)}")
    elif "provider" in content:
        print(f"{file}: fine. {_skin(file)}")
    else:
        print(f"{file}: fine. {_robot(file)}")


def _robot(file: Path) -> str:
    from wbc_suite.robot import load_robot

    robot = load_robot(file)
    simulated = robot.to_mjspec().compile()
    computed = robot.to_pinocchio()
    return (
        f"Robot '{robot.name}': {len(robot.links)} links, {robot.dof} dof, "
        f"{robot.mass:.1f} kg, {robot.root.kind} root; MuJoCo and Pinocchio models "
        f"with nv = {simulated.nv} and {computed.nv}."
    )


def _skin(file: Path) -> str:
    from wbc_suite.robot.skins import read_skin

    table = read_skin(file)
    meshes = sum(len(pieces) for pieces in table.link.values())
    return f"Skin of {len(table.link)} links with {meshes} meshes of {table.provider}."


def _benchmark(file: Path) -> str:
    from wbc_suite.benchmark import load_benchmark

    benchmark = load_benchmark(file)
    return f"Benchmark '{benchmark.name}': {benchmark.horizon} actions an episode."


def _controller(file: Path, robot: str | None) -> str:
    from wbc_suite.control import load_composite_controller_config

    config = load_composite_controller_config(file, robot)
    given = config.get("body_parts")
    if given is None:
        frames = ", ".join(frame["name"] for frame in config["frame"])
        return f"{config['type']} of {frames}."
    parts = ", ".join(f"{name} ({part['type']})" for name, part in given.items())
    return f"{config['type']} of {parts}."
