"""`wbc-suite teleop`, and what `record` shares with it: device, page, session."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wbc_suite.cli.options import (
    BaseOption,
    CatalogueOption,
    DeviceOptions,
    GripperOption,
    HostOption,
    MirrorOption,
    PortOption,
    RobotsOption,
    ScaleOption,
    SkinOption,
    check_names,
    chosen,
    device_options,
    robot_names,
    serve_until_interrupted,
)
from wbc_suite.cli.output import print

if TYPE_CHECKING:
    import gymnasium

    from wbc_suite.devices import Device, PipelineConfig
    from wbc_suite.recording.episode_control import EpisodeControl

ONE_DAY = 86_400  # s; horizon of a session, in place of the benchmark's
POLL_PERIOD = 0.2  # s; of a session without a page
DRIVING = ("keyboard", "gamepad", "dualsense")
"""Devices whose keys and sticks drive robots that walk, at first."""
DeviceMaker = Callable[["gymnasium.Env[Any, Any]"], "Device"]


WholeBodyOption = Annotated[
    str | None,
    typer.Option(
        help="Whole-body controller, by name or TOML file; by default WHOLE_BODY_ID "
        "for robots that walk, otherwise WHOLE_BODY_IK."
    ),
]
TargetRateOption = Annotated[
    float, typer.Option(help="Control rate, Hz.", min=5.0, max=200.0)
]
DeviceOption = Annotated[
    str | None,
    typer.Option(
        help="Input device, besides the page's handles: headset, keyboard, stream, "
        "spacemouse, gamepad or dualsense (move while L1 is held), mjgui or your own "
        "module:Class."
    ),
]
TlsCertOption = Annotated[
    Path | None,
    typer.Option(help="Certificate for the headset's page, a PEM file."),
]
TlsKeyOption = Annotated[
    Path | None, typer.Option(help="Private key of --tls-cert, a PEM file.")
]
RecordOption = Annotated[
    Path | None,
    typer.Option(
        help="File for episodes recorded with the page's button Record, which returns "
        "the robot to its start."
    ),
]


def teleop(
    benchmark: Annotated[str, typer.Argument(help="Benchmark to run.")] = "Lift",
    others: Annotated[list[str] | None, typer.Argument(hidden=True)] = None,
    robots: RobotsOption = None,
    controller: WholeBodyOption = None,
    rate: TargetRateOption = 100.0,
    gripper: GripperOption = None,
    base: BaseOption = None,
    skin: SkinOption = None,
    seed: Annotated[int, typer.Option(help="Seed of the scene.")] = 0,
    host: HostOption = "127.0.0.1",
    port: PortOption = None,
    device: DeviceOption = None,
    device_option: DeviceOptions = None,
    tls_cert: TlsCertOption = None,
    tls_key: TlsKeyOption = None,
    scale: ScaleOption = 1.0,
    mirror: MirrorOption = False,
    record: RecordOption = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Move a robot's hands, head, feet and base in a web page, or let it walk."""
    import wbc_suite
    from wbc_suite.recording.episode_control import EpisodeControl
    from wbc_suite.wrappers import DataCollection

    names = robot_names([*(robots or ["GR1"]), *(others or ())])
    check_names(
        benchmarks=[benchmark],
        robots=names,
        controllers=[controller],
        gripper=gripper,
        base=base,
    )
    pairs = [*(device_option or []), *tls_options(tls_cert, tls_key)]
    make = None if device is None else device_maker(device, pairs)
    stages = stages_of(device, scale=scale, mirror=mirror)
    label = " and ".join(names)
    print(f"Building {benchmark} with {label} ...", flush=True)
    env: gymnasium.Env[Any, Any] = wbc_suite.make(
        benchmark,
        robots=names,
        controller_configs=controller or default_controller(*names),
        gripper_types=chosen(gripper),
        base_types=base,
        control_freq=rate,
        horizon=round(ONE_DAY * rate),
        skin=skin,
    )
    episode_control = None
    chosen_device = None if make is None else make(env)
    if record is not None:
        env = collection = DataCollection(env, record, automatic=False)
        episode_control = EpisodeControl(collection.recorder, seed=seed)
    try:
        drive(
            env,
            names=(label, benchmark),
            rate=rate,
            seed=seed,
            address=(host, port),
            device=chosen_device,
            stages=stages,
            episode_control=episode_control,
        )
    finally:
        env.close()


def default_controller(*robots: str) -> str:
    """Return the whole-body controller that robots are teleoperated with."""
    from wbc_suite.control import default_composite
    from wbc_suite.robot import load_robot

    walks = "WHOLE_BODY_ID"
    defaults = {default_composite(load_robot(robot)) for robot in robots}
    return walks if defaults == {walks} else "WHOLE_BODY_IK"


def device_maker(name: str, pairs: list[str] | None) -> DeviceMaker:
    """Return a function that makes a device with options `NAME=VALUE`."""
    from wbc_suite.devices import DEVICES

    make, options = DEVICES.find(name), device_options(pairs)

    def build(env: "gymnasium.Env[Any, Any]") -> "Device":
        if name.lower() == "mjgui":
            options["env"] = env  # it shows the scene
        layout = env.unwrapped.action_layout  # type: ignore[attr-defined]
        walks = any(part.name.endswith("walk") for part in layout.slices)
        if walks and name.lower() in DRIVING:
            options.setdefault("drives", True)
        return make(**options)

    return build


def tls_options(cert: Path | None, key: Path | None) -> list[str]:
    """Return the options of a device for `--tls-cert` and `--tls-key`."""
    given = {"tls_cert": cert, "tls_key": key}
    return [f"{name}={json.dumps(str(path))}" for name, path in given.items() if path]


def stages_of(device: str | None, *, scale: float, mirror: bool) -> "PipelineConfig":
    """Return the pipeline's stages: the defaults, but for a mouse alone."""
    from wbc_suite.devices import PipelineConfig
    from wbc_suite.devices.pipeline.config import DRAGGED

    by_mouse = device is None or device.lower() == "mjgui"
    stages = DRAGGED if by_mouse else PipelineConfig()
    return stages.model_copy(update={"mirror": mirror, "scale": scale})


def drive(
    env: "gymnasium.Env[Any, Any]",
    *,
    names: tuple[str, str],
    rate: float,
    seed: int,
    address: tuple[str, int | None] | None,
    device: "Device | None",
    stages: "PipelineConfig",
    episode_control: "EpisodeControl | None",
) -> None:
    """Run a session until it is ended, or all planned episodes are recorded.

    Args:
        env: Environment, made; the caller closes it.
        names: Robot and benchmark, for titles.
        rate: Actions per second, Hz.
        seed: Seed of every reset but those of recordings.
        address: Where the page is served, host and port; None for a device alone.
        device: A device beside the page.
        stages: Stages between inputs and the controller.
        episode_control: Starts and ends recorded episodes.
    """
    from wbc_suite.devices.headset import Headset
    from wbc_suite.viewers.headset_view import SessionView
    from wbc_suite.viewers.loop_timing import prepare_interpreter
    from wbc_suite.viewers.page_process import PageProcess
    from wbc_suite.viewers.status_text import timing_text
    from wbc_suite.viewers.teleop_session import TeleopSession

    session = TeleopSession(
        env,
        period=1.0 / rate,
        seed=seed,
        device=device,
        pipeline=stages,
        episode_control=episode_control,
    )
    robots, benchmark = names
    page = None
    try:
        if address is not None:  # it gets ready while the controllers are compiled
            label = f"{robots} · {benchmark}"
            page = PageProcess(session, *address, label=label)
        if device is not None:
            device.start()
        print("Preparing the controllers ...", flush=True)
        session.tick()
        if isinstance(device, Headset):
            device.show(SessionView(session, f"{robots} · {benchmark}"))
        if page is not None:
            page.wait()
        prepare_interpreter()
        session.start(urgent=True)
        print(getattr(device, "help", ""), end="", flush=True)
        if page is None:
            while session.running and not session.quit.wait(POLL_PERIOD):
                pass
        else:
            title = f"Teleoperation of {robots}, {benchmark}:"
            serve_until_interrupted(page, title, until=session.quit)
            page.check()
    finally:
        session.stop()
        if session.snapshot.tick > 1:
            print(timing_text(session.snapshot), flush=True)
        if page is not None:
            page.stop()
        if device is not None:
            device.stop()
