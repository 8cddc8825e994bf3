"""Options that several commands share."""

import os
import threading
import tomllib
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import typer

from wbc_suite.catalogue import ENVIRONMENT_VARIABLE
from wbc_suite.cli.output import print
from wbc_suite.errors import ConfigError

if TYPE_CHECKING:
    from wbc_suite.viewers.page_process import PageProcess
    from wbc_suite.viewers.page_server import PageServer

T = TypeVar("T")

RobotArgument = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="Name (`wbc-suite list`), a .toml, .urdf or .xml file, or "
        "menagerie:NAME or robot_descriptions:NAME.",
    ),
]
GripperOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Gripper: NAME, or right=NAME,left=NAME, or none for no gripper.",
    ),
]
BaseOption = Annotated[
    str | None, typer.Option(metavar="NAME", help="Base, or none for no base.")
]
ExecutorOption = Annotated[
    str, typer.Option(metavar="NAME", help="process, serial, ray or slurm.")
]
RootOption = Annotated[
    Literal["fixed", "planar", "free"] | None,
    typer.Option(
        help="Root of the robot; by default as in the file, but free for a URDF with "
        "four feet or more."
    ),
]
SkinOption = Annotated[
    str | None,
    typer.Option(
        metavar="meshes|DIR|none",
        help="Draw with real meshes, from installed packages or from a folder; "
        "files have their own, which none leaves out.",
    ),
]
MeshRootOption = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="Folder to read meshes from; by default the file's own package.",
    ),
]
StrictOption = Annotated[
    bool,
    typer.Option(
        "--strict", help="Refuse a faulty URDF or MJCF file instead of mending it."
    ),
]
RobotsOption = Annotated[
    list[str] | None,
    typer.Option(help="Robot, or several in one scene: Panda,Panda."),
]
ControllerOption = Annotated[
    str | None, typer.Option(help="Controller, by name or file.")
]
CamerasOption = Annotated[
    list[str] | None, typer.Option("--camera", help="Camera; may be repeated.")
]
PictureSizeOption = Annotated[
    int, typer.Option(min=8, max=2048, help="Width and height of images, pixels.")
]
RecordingArgument = Annotated[Path, typer.Argument(help="Recording.")]
TrustFilesOption = Annotated[
    bool,
    typer.Option(
        "--trust-files", help="Read files and import modules that the recording names."
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]
HorizonOption = Annotated[
    int | None, typer.Option(min=1, help="Maximum actions of an episode.")
]
WorkersOption = Annotated[
    int | None, typer.Option(min=1, help="Workers; one per processor by default.")
]
DeviceOptions = Annotated[
    list[str] | None,
    typer.Option(
        "--device-option",
        metavar="NAME=VALUE",
        help="Option of the device; may be repeated.",
    ),
]
ScaleOption = Annotated[
    float, typer.Option(help="Hand motion over device motion.", min=0.01)
]
MirrorOption = Annotated[
    bool, typer.Option("--mirror", help="Swap left and right, to face the robot.")
]
HostOption = Annotated[
    str,
    typer.Option(
        help="Address to listen on. On any but 127.0.0.1 a token is required."
    ),
]
PortOption = Annotated[
    int | None,
    typer.Option(
        help="Port to listen on; 0 for any free one. By default the first free one "
        "from 8080.",
        min=0,
        max=65535,
    ),
]


def robot_names(given: Sequence[str] | None) -> list[str]:
    """Return the robots of an option that is repeated, or has commas."""
    return [name.strip() for names in given or () for name in names.split(",")]


def check_names(
    *,
    benchmarks: Sequence[str] = (),
    robots: Sequence[str] = (),
    controllers: Sequence[str | None] = (),
    policies: Sequence[str] = (),
    devices: Collection[str] = (),
    gripper: str | None = None,
    base: str | None = None,
) -> None:
    """Raise an error for a name or file that is wrong, before work begins.

    Experts are looked up for all benchmarks, controllers for all robots, which are
    those of the benchmarks where none is given. A policy's place may also take one of
    `devices`.
    """
    from wbc_suite.benchmark import load_benchmark
    from wbc_suite.control import load_composite_controller_config
    from wbc_suite.robot import load_robot

    made = [load_benchmark(name) for name in benchmarks]
    robots = robots or sorted({name for benchmark in made for name in benchmark.robots})
    loaded = [load_robot(name, gripper=chosen(gripper), base=base) for name in robots]
    for controller in filter(None, controllers):
        for robot in loaded:
            load_composite_controller_config(controller, robot)
    if policies:
        from wbc_suite.evaluation import check_policy
        from wbc_suite.experts import find_expert

        for policy in policies:
            check_policy(policy, devices)
            for benchmark in made if policy == "expert" else ():
                find_expert(benchmark)


def _add_to_catalogue(folders: list[Path] | None) -> list[Path]:
    """Add folders to every `Catalogue()` of this process."""
    if folders:
        known = os.environ.get(ENVIRONMENT_VARIABLE, "")
        all_folders = filter(None, [known, *map(str, folders)])
        os.environ[ENVIRONMENT_VARIABLE] = os.pathsep.join(all_folders)
    return folders or []


CatalogueOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--catalogue",
        metavar="DIR",
        help="Another folder with robots/, tasks/, controllers/; repeatable.",
        callback=_add_to_catalogue,
    ),
]


def chosen(gripper: str | None) -> str | dict[str, str] | None:
    """Return the value of `--gripper`: one for all sides, or one for each."""
    if gripper is None or "=" not in gripper:
        return gripper
    pairs = (part.partition("=") for part in gripper.split(","))
    return {side.strip(): name.strip() for side, _, name in pairs}


def environment_arguments(
    benchmark: str,
    *,
    robots: Sequence[str] | None,
    controller: str | None,
    gripper: str | None,
    base: str | None,
    horizon: int | None = None,
    policies: Sequence[str] = (),
    devices: Collection[str] = (),
) -> dict[str, Any]:
    """Return the arguments of `make` for the options that are given, once checked."""
    names = robot_names(robots)
    check_names(
        benchmarks=[benchmark],
        robots=names,
        controllers=[controller],
        policies=policies,
        devices=devices,
        gripper=gripper,
        base=base,
    )
    arguments: dict[str, Any] = {
        "horizon": horizon,
        "robots": names[0] if len(names) == 1 else names,
        "controller_configs": controller,
        "gripper_types": chosen(gripper),
        "base_types": base,
    }
    return {name: value for name, value in arguments.items() if value}


def camera_arguments(cameras: list[str] | None, size: int) -> dict[str, Any]:
    """Return the arguments of `make` for square pictures; none without cameras."""
    if not cameras:
        return {}
    return {
        "use_camera_obs": True,
        "camera_names": tuple(cameras),
        "camera_heights": size,
        "camera_widths": size,
    }


def device_options(pairs: list[str] | None) -> dict[str, object]:
    """Return the options of `--device-option NAME=VALUE`, TOML values or texts."""
    options: dict[str, object] = {}
    for pair in pairs or []:
        name, equals, value = pair.partition("=")
        if not equals:
            raise ConfigError(f"--device-option {pair}: write NAME=VALUE.")
        try:
            options[name] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            options[name] = value
    return options


@contextmanager
def progress(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show a bar on the error output where that is a terminal; call to advance it.

    It has no thread of its own, so that workers may be forked meanwhile.
    """
    from rich import progress as rich
    from rich.console import Console

    console = Console(stderr=True)
    columns = rich.BarColumn(), rich.MofNCompleteColumn(), rich.TimeRemainingColumn()
    bar = rich.Progress(
        title, *columns, console=console, transient=True, auto_refresh=False
    )
    bar.disable = not console.is_terminal

    def advance(done: int) -> None:
        bar.advance(line, done)
        bar.refresh()

    with bar:
        line = bar.add_task(title, total=total)
        yield advance


def tracked(items: Sequence[T], title: str) -> Iterator[T]:
    """Yield items one by one, and show how many are finished."""
    with progress(title, len(items)) as advance:
        for item in items:
            yield item
            advance(1)


def print_address(site: "PageServer | PageProcess") -> None:
    """Print the address of a page."""
    print(f"\n    {site.url}\n", flush=True)
    if site.token is not None:
        print("Anyone who has this address can use the page.", flush=True)


def serve_until_interrupted(site: "PageServer", title: str) -> None:
    """Print the address of a page, and serve it until Ctrl-C."""
    print(title)
    print_address(site)
    print("Press Ctrl-C to stop.", flush=True)
    try:
        threading.Event().wait()
    finally:
        site.stop()
