"""`wbc-suite list | check | schema`: what the catalogue has, and files for it."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer

from wbc_suite.cli.options import CatalogueOption

if TYPE_CHECKING:
    from rich.table import Table

    from wbc_suite.catalogue import Catalogue

Kind = Literal["robots", "grippers", "bases", "benchmarks", "controllers"]

_FOLDERS = {
    "grippers": "robots/gripper",
    "bases": "robots/base",
    "benchmarks": "tasks",
    "controllers": "controllers",
}


def list_catalogue(
    kind: Annotated[
        Kind | None, typer.Argument(help="Everything when left out.")
    ] = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Show the robots, grippers, bases, benchmarks and controllers there are."""
    from rich.console import Console

    from wbc_suite.catalogue import Catalogue

    console = Console(soft_wrap=True)
    known = Catalogue()
    kinds: tuple[Kind, ...] = (kind,) if kind else get_args(Kind)
    for chosen in kinds:
        if chosen == "robots":
            console.print(_robots(known))
        elif chosen in ("grippers", "bases"):
            console.print(_components(known, chosen))
        else:
            console.print(_files(known, chosen))


def _robots(catalogue: "Catalogue") -> "Table":
    from wbc_suite.robot import load_robot

    table = _table("Robots", "name", "", "dof", "kg", "root")
    for name in catalogue.names("robots"):
        robot = load_robot(name, catalogue=catalogue)
        numbers = str(robot.dof), f"{robot.mass:.1f}"
        table.add_row(robot.name, robot.title, *numbers, robot.root.kind)
    return table


def _components(catalogue: "Catalogue", kind: Kind) -> "Table":
    """List grippers with the side they fit, bases with the root they bring."""
    from wbc_suite.robot.robot_file import Component, read_robot_file

    what = "side" if kind == "grippers" else "root"
    table = _table(kind.capitalize(), "name", "", what, "kg")
    for path in catalogue.files(_FOLDERS[kind]):
        component = read_robot_file(path)
        if not isinstance(component, Component):
            continue
        header = component.component
        fits = header.side or "both" if what == "side" else component.root.kind
        mass = sum(link.mass for link in component.links)
        table.add_row(header.name, header.title, fits, f"{mass:.2f}")
    return table


def _files(catalogue: "Catalogue", kind: Kind) -> "Table":
    from wbc_suite.tomlfile import read_toml

    table = _table(kind.capitalize(), "name", "")
    if kind == "controllers":
        from wbc_suite.control import composite_names
        from wbc_suite.control.part.registry import part_models

        for name in composite_names():
            table.add_row(name, "for any robot, with its file below when there is one")
        for name, model in part_models().items():
            about = str(model.__doc__).split("\n")[0].partition(";")[0]
            table.add_row(name, f"of one part: {about}")
    for path in catalogue.files(_FOLDERS[kind]):
        content = read_toml(path)
        if kind == "controllers":
            table.add_row(path.stem, _controlled(content))
        else:
            table.add_row(content["name"], content["title"])
    return table


def _controlled(content: dict[str, Any]) -> str:
    """Return what a controller's file controls."""
    if "body_parts" in content:
        parts = content["body_parts"].items()
        return ", ".join(f"{name}: {part['type']}" for name, part in parts)
    walk = ["walk", "height"] if "gait" in content else []
    return ", ".join([*(frame["name"] for frame in content.get("frame", ())), *walk])


def _table(title: str, *columns: str) -> "Table":
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold", box=None)
    for column in columns:
        right = column in ("dof", "kg")
        table.add_column(
            column, justify="right" if right else "left", no_wrap=column == "name"
        )
    return table


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
    """Check a robot, benchmark or controller file, and print a summary.

    The file is read as loading reads it, and a robot's models are built for both
    engines. The first error names the file, the key, the value and the rule. A JSON
    file is a controller of robosuite, which needs its robot.
    """
    from wbc_suite.tomlfile import read_toml

    content = read_toml(file) if file.suffix == ".toml" else {"component": None}
    controls = not content.keys().isdisjoint(("body_parts", "frame", "gait"))
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
    return f"{config['type']} of {_controlled(config)}."


def print_schema(
    kind: Annotated[
        Literal["component", "assembly", "frame"],
        typer.Argument(help="Kind of robot file, or a stream's pose frame."),
    ],
) -> None:
    """Print the JSON Schema of robot files, or of the frames that a stream takes."""
    from wbc_suite.devices.pose_frame import frame_schema
    from wbc_suite.robot.robot_file import robot_schema

    schema = frame_schema() if kind == "frame" else robot_schema(kind)
    print(json.dumps(schema, indent=2))
