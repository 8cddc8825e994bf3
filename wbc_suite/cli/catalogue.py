"""`wbc-suite list | check | schema`: what the catalogue has, and files for it."""

import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias, get_args

import typer

from wbc_suite.cli import options
from wbc_suite.cli.output import print
from wbc_suite.errors import printable

if TYPE_CHECKING:
    from wbc_suite.robot import RobotDescription

Kind = Literal["robots", "grippers", "bases", "benchmarks", "controllers"]
Row: TypeAlias = tuple[str | int | float, ...]


def list_catalogue(
    kind: Annotated[
        Kind | None, typer.Argument(help="What to list; all by default.")
    ] = None,
    as_json: options.JsonOption = False,
    catalogue: options.CatalogueOption = None,
) -> None:
    """List robots, grippers, bases, benchmarks and controllers.

    Masses are those of the robots themselves, without a pedestal.
    """
    from rich.console import Console
    from rich.table import Table

    from wbc_suite.catalogue import Catalogue

    console, catalogued = Console(soft_wrap=True), Catalogue()
    kinds: tuple[Kind, ...] = (kind,) if kind else get_args(Kind)
    if as_json:
        found = {}
        for listed in kinds:
            folder, columns, rows = _LISTS[listed]
            keys = [column or "title" for column in columns]
            content = rows(catalogued.files(folder))
            found[listed] = [dict(zip(keys, row, strict=True)) for row in content]
        print(json.dumps(found))
        return
    for listed in kinds:
        folder, columns, rows = _LISTS[listed]
        table = Table(title_justify="left", title_style="bold", box=None)
        table.title = listed.capitalize()
        for column in columns:
            side = "right" if column.endswith(("dof", "kg")) else "left"
            table.add_column(column, justify=side, no_wrap=column == "name")
        for row in rows(catalogued.files(folder)):
            table.add_row(*(printable(_shown(value)) for value in row))
        console.print(table)


def _shown(value: str | int | float) -> str:
    return f"{value:.2f}" if isinstance(value, float) else str(value)


def _robots(files: Sequence[Path]) -> Iterator[Row]:
    from wbc_suite.robot import load_robot

    for file in files:
        robot, bare = load_robot(file), load_robot(file, base="NullMount")
        own = bare if robot.root.kind == "fixed" else robot  # without a pedestal
        numbers = robot.dof, round(own.mass, 3), bare.dof, round(bare.mass, 3)
        yield robot.name, robot.title, *numbers, robot.root.kind


def _components(files: Sequence[Path]) -> Iterator[Row]:
    """Yield grippers with the side they fit, bases with the root they bring."""
    from wbc_suite.robot.robot_file import Component, read_robot_file

    for component in map(read_robot_file, files):
        if not isinstance(component, Component):
            continue
        header = component.component
        is_base = header.kind == "base"
        fits = component.root.kind if is_base else header.side or "both"
        mass = sum(link.mass for link in component.links)
        yield header.name, header.title, fits, round(mass, 3)


def _benchmarks(files: Sequence[Path]) -> Iterator[Row]:
    from wbc_suite.benchmark.base import BenchmarkFile

    for file in files:
        content = BenchmarkFile.read(file).data
        yield str(content.get("name", file.stem)), str(content.get("title", ""))


def _controllers(files: Sequence[Path]) -> Iterator[Row]:
    from wbc_suite.config_files import read_toml
    from wbc_suite.control import COMPOSITES, PART_CONTROLLERS

    for name in COMPOSITES:
        yield name, "for any robot; its file, if it has one, is listed below"
    for name in PART_CONTROLLERS:
        about, *_ = str(PART_CONTROLLERS[name].config.__doc__).splitlines()
        yield name, f"for one part: {about.partition(';')[0]}"
    for file in files:
        yield file.stem, _controlled(read_toml(file))


ALONE = ("bare dof", "bare kg")  # without a base that drives, too
_LISTS = {
    "robots": ("robots", ("name", "", "dof", "kg", *ALONE, "root"), _robots),
    "grippers": ("robots/gripper", ("name", "", "side", "kg"), _components),
    "bases": ("robots/base", ("name", "", "root", "kg"), _components),
    "benchmarks": ("tasks", ("name", ""), _benchmarks),
    "controllers": ("controllers", ("name", ""), _controllers),
}
"""Folder, columns, and function that yields the rows of each kind."""


def _controlled(content: dict[str, Any]) -> str:
    if "extends" in content:
        return f"changes {content['extends']}"
    if "body_parts" in content:
        parts = content["body_parts"].items()
        return ", ".join(f"{name}: {part['type']}" for name, part in parts)
    walk = ["walk", "height"] if "gait" in content else []
    return ", ".join([*(frame["name"] for frame in content.get("frame", ())), *walk])


def check_file(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A .toml, .json, .urdf or .xml file.")
    ],
    robot: Annotated[
        str | None,
        typer.Option(metavar="ROBOT", help="Robot to check a controller for."),
    ] = None,
    root: options.RootOption = None,
    mesh_root: options.MeshRootOption = None,
    strict: options.StrictOption = False,
    as_json: options.JsonOption = False,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Check a robot, benchmark or controller file, and print a summary.

    A robot's models are built for both engines. Of a robot in a URDF or MJCF file it
    also prints what was inferred, and simulates a second in the posture `ready`, with
    warnings for what falls or moves. The first error names the file, the key, the value
    and the rule. A JSON file is a controller config of robosuite; it needs --robot.
    """
    from wbc_suite.config_files import read_toml
    from wbc_suite.robot.named_files import named_file

    file = named_file(str(file)) or file
    content = read_toml(file) if file.suffix == ".toml" else {"component": None}
    inferred: dict[str, list[str]] = {}
    controls = _controls(file, content)
    if "name" in content or ("extends" in content and not controls):
        from wbc_suite.benchmark import load_benchmark

        benchmark = load_benchmark(file)
        found = f"Benchmark '{benchmark.name}': {benchmark.horizon} actions an episode."
    elif file.suffix == ".json" or (controls and "component" not in content):
        from wbc_suite.control import load_composite_controller_config

        config = load_composite_controller_config(file, robot)
        found = f"{config['type']} of {_controlled(config)}."
    elif "provider" in content or "model" in content:
        from wbc_suite.robot.skins import read_skin

        skin = read_skin(file)
        meshes = sum(len(pieces) for pieces in skin.link.values())
        found = f"Skin: {len(skin.link)} links with {meshes} meshes, {len(skin.model)} "
        found += f"models; packages: {', '.join(skin.providers)}."
    else:
        found, inferred = _robot(file, root=root, mesh_root=mesh_root, strict=strict)
    if as_json:
        fields = {"inferred": inferred} if inferred else {}
        print(json.dumps({"file": str(file), "fine": True, "summary": found} | fields))
        return
    print(f"{file}: fine. {found}")
    for key, items in inferred.items():
        print(f"  {key.ljust(8)}  {items.pop(0) if items else 'none'}")
        print("".join(f"{' ' * 12}{item}\n" for item in items), end="")


def _controls(file: Path, content: dict[str, Any]) -> bool:
    """Whether a TOML file is that of a controller."""
    from wbc_suite.catalogue import Catalogue
    from wbc_suite.control import COMPOSITES

    base = content.get("extends")
    named = isinstance(base, str) and Catalogue().holds("controllers", base)
    return (
        not content.keys().isdisjoint(("body_parts", "frame", "gait"))
        or base in COMPOSITES
        or named
    )


def _robot(file: Path, **given: Any) -> tuple[str, dict[str, list[str]]]:
    """Return a summary of a robot, and what was inferred if its file is not ours."""
    from wbc_suite.envs.hold_check import hold_faults
    from wbc_suite.robot import load_robot

    robot = load_robot(file, **given)
    for fault in hold_faults(robot) if file.suffix != ".toml" else ():
        print(f"Warning: {fault}", file=sys.stderr)
    simulated = robot.to_mjspec().compile()
    computed = robot.to_pinocchio()
    summary = (
        f"Robot '{robot.name}': {len(robot.links)} links, {robot.dof} dof, "
        f"{robot.weight_text}, {robot.root.kind} root; MuJoCo and Pinocchio models "
        f"with nv = {simulated.nv} and {computed.nv}."
    )
    return summary, {} if file.suffix == ".toml" else _inferred(robot)


def _inferred(robot: "RobotDescription") -> dict[str, list[str]]:
    """Return what an import inferred, as texts."""
    from wbc_suite.robot.wheel_drive import WheelDrive

    ready = robot.keyframe("ready")
    return {
        "root": [f"{robot.root.kind}, first link '{robot.links[0].name}'"],
        "groups": [f"{name}: {', '.join(own)}" for name, own in robot.groups.items()],
        "hands": [
            f"{side}: frame '{frame}' on link '{robot.link_of(frame)}'"
            for side, frame in robot.hands.items()
        ],
        "gripper": [
            f"{name}: {synergy.reason}"
            for name, own in robot.synergies.items()
            for synergy in own
        ],
        "ready": [", ".join(f"{name} {q:.3g}" for name, q in ready.items())],
        **({"drive": [str(WheelDrive(robot))]} if robot.wheels else {}),
    }


def print_schema(
    kind: Annotated[
        Literal["component", "assembly", "frame"],
        typer.Argument(help="Kind of robot file, or a stream's pose frame."),
    ],
) -> None:
    """Print the JSON Schema of robot files, or of the frames that a stream takes."""
    from wbc_suite.devices.pose_frame import PoseFrame
    from wbc_suite.robot.robot_file import robot_schema

    schema = PoseFrame.model_json_schema() if kind == "frame" else robot_schema(kind)
    print(json.dumps(schema, indent=2))
