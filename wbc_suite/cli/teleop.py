"""`wbc-suite teleop`, and the session of an operator, which `record` has too."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wbc_suite.cli import options
from wbc_suite.cli.output import print

if TYPE_CHECKING:
    import gymnasium

    from wbc_suite.devices import Device, PipelineConfig
    from wbc_suite.recording.episode_control import RecordingPlan
    from wbc_suite.viewers.page_process import PageProcess

ONE_DAY = 86_400  # s; horizon of a session, in place of the benchmark's
POLL_PERIOD = 0.2  # s
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
    robots: options.RobotsOption = None,
    controller: WholeBodyOption = None,
    rate: TargetRateOption = 100.0,
    gripper: options.GripperOption = None,
    base: options.BaseOption = None,
    skin: options.SkinOption = None,
    seed: Annotated[int, typer.Option(help="Seed of the scene.")] = 0,
    host: options.HostOption = "127.0.0.1",
    port: options.PortOption = None,
    device: DeviceOption = None,
    device_option: options.DeviceOptions = None,
    tls_cert: TlsCertOption = None,
    tls_key: TlsKeyOption = None,
    scale: options.ScaleOption = 1.0,
    mirror: options.MirrorOption = False,
    record: RecordOption = None,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Move a robot's hands, head, feet and base in a web page, or let it walk."""
    names = options.robot_names([*(robots or ["GR1"]), *(others or ())])
    arguments = options.environment_arguments(
        benchmark,
        robots=names,
        controller=controller,
        gripper=gripper,
        base=base,
        horizon=round(ONE_DAY * rate),
    )
    arguments |= {"skin": skin, "control_freq": rate}
    tls = {"tls_cert": tls_cert, "tls_key": tls_key}
    pairs = [f"{name}={json.dumps(str(path))}" for name, path in tls.items() if path]
    run_session(
        benchmark,
        arguments,
        robots=names,
        address=(host, port),
        device=device,
        device_options=[*(device_option or ()), *pairs],
        stages={"scale": scale, "mirror": mirror},
        seed=seed,
        out=record,
    )


def run_session(
    benchmark: str,
    arguments: dict[str, Any],
    *,
    robots: Sequence[str],
    address: tuple[str, int | None] | None,
    device: str | None,
    device_options: list[str] | None,
    stages: Mapping[str, Any],
    seed: int,
    out: Path | None = None,
    next_obs: bool = False,
    plan: "RecordingPlan | None" = None,
) -> int:
    """Let an operator act until the session is ended, or its plan is recorded.

    Args:
        benchmark: Name or file.
        arguments: Those of `make`; without a controller, `default_controller`. The
            page is up before the environment is made.
        robots: Names or files.
        address: Host and port of the page; None for a device alone.
        device: Name of a device beside the page.
        device_options: Its options, `NAME=VALUE`.
        stages: Changes of the pipeline's settings.
        seed: Seed of every reset but those of recordings.
        out: File for recorded episodes.
        next_obs: See `Recorder`.
        plan: What is recorded; None for what the operator asks for.

    Returns:
        Number of episodes in the file.
    """
    import wbc_suite
    from wbc_suite.recording.episode_control import EpisodeControl
    from wbc_suite.wrappers import DataCollection

    title = f"{' and '.join(robots)} · {benchmark}"
    with _served_page(address, robots[0], title) as page:
        make = device and device_maker(device, device_options)
        if "controller_configs" not in arguments:
            arguments["controller_configs"] = default_controller(*robots)
        if page is not None:
            page.check()
        env: gymnasium.Env[Any, Any] = wbc_suite.make(benchmark, **arguments)
        used, control = make(env) if make else None, None
        if out is not None:
            env = collected = DataCollection(
                env, out, automatic=False, next_obs=next_obs
            )
            control = EpisodeControl(
                collected.recorder,
                seed=seed,
                plan=plan,
                report=lambda text: print(f"  {text}", flush=True),
            )
        with closing(env):
            _drive(
                env,
                page,
                title,
                device=used,
                period=1.0 / arguments["control_freq"],
                seed=seed,
                pipeline=stages_of(device, **stages),
                episode_control=control,
            )
    return control.status.kept if control else 0


@contextmanager
def _served_page(
    address: tuple[str, int | None] | None, robot: str, title: str
) -> Iterator["PageProcess | None"]:
    """Serve a page, if it has an address; it shows a robot until there is a session."""
    from wbc_suite.viewers.page_process import PageProcess

    page = None
    print(f"{title}: getting ready ...", flush=True)
    if address is not None:
        page = PageProcess(
            *address, label=title, robot=robot, on_open=options.print_address
        )
    try:
        yield page
    finally:
        if page is not None:
            page.stop()


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

    make, given = DEVICES.find(name), options.device_options(pairs)

    def build(env: "gymnasium.Env[Any, Any]") -> "Device":
        if name.lower() == "mjgui":
            given["env"] = env  # it shows the scene
        layout = env.unwrapped.action_layout  # type: ignore[attr-defined]
        walks = any(part.name.endswith("walk") for part in layout.slices)
        if walks and name.lower() in DRIVING:
            given.setdefault("drives", True)
        return make(**given)

    return build


def stages_of(device: str | None, *, scale: float, mirror: bool) -> "PipelineConfig":
    """Return the pipeline's stages: the defaults, but for a mouse alone."""
    from wbc_suite.devices import PipelineConfig
    from wbc_suite.devices.pipeline.config import DRAGGED

    by_mouse = device is None or device.lower() == "mjgui"
    stages = DRAGGED if by_mouse else PipelineConfig()
    return stages.model_copy(update={"mirror": mirror, "scale": scale})


def _drive(
    env: "gymnasium.Env[Any, Any]",
    page: "PageProcess | None",
    title: str,
    *,
    device: "Device | None",
    **session_arguments: Any,
) -> None:
    """Run a session with a device until it is ended; see `TeleopSession`."""
    from wbc_suite.devices.headset import Headset
    from wbc_suite.viewers.headset_view import SessionView
    from wbc_suite.viewers.loop_timing import prepare_interpreter
    from wbc_suite.viewers.status_text import timing_text
    from wbc_suite.viewers.teleop_session import TeleopSession

    session = TeleopSession(env, device=device, **session_arguments)
    try:
        if device is not None:
            device.start()
        session.tick()
        if isinstance(device, Headset):
            device.show(SessionView(session, title))
        if page is not None:
            page.attach(session)
        prepare_interpreter()
        session.start(urgent=True)
        print(getattr(device, "help", ""), end="", flush=True)
        print("Ready. Press Ctrl-C to stop.", flush=True)
        shown = page is not None  # it says what ended the loop
        while (shown or session.running) and not session.quit.wait(POLL_PERIOD):
            pass
        if page is not None:
            page.check()
    finally:
        session.stop()
        if session.snapshot.tick > 1:
            print(timing_text(session.snapshot), flush=True)
        if device is not None:
            device.stop()
