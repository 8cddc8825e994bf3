"""`wbc-suite teleop`: move a simulated robot in the browser."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wbc_suite.cli.by_hand import ONE_DAY, device_maker, drive, stages_of
from wbc_suite.cli.options import (
    BaseOption,
    CatalogueOption,
    DeviceOptions,
    GripperOption,
    MirrorOption,
    ScaleOption,
    SkinOption,
    chosen,
)
from wbc_suite.cli.serving import HostOption, PortOption

if TYPE_CHECKING:
    import gymnasium

__all__ = ["teleop"]


def teleop(
    benchmark: Annotated[str, typer.Argument(help="Benchmark to play in.")] = "Lift",
    robots: Annotated[str, typer.Option(help="Robot.")] = "GR1",
    controller: Annotated[
        str, typer.Option(help="Whole-body controller, by name or TOML file.")
    ] = "WHOLE_BODY_IK",
    rate: Annotated[
        float, typer.Option(help="Targets taken per second, Hz.", min=5.0, max=200.0)
    ] = 100.0,
    gripper: GripperOption = None,
    base: BaseOption = None,
    skin: SkinOption = None,
    seed: Annotated[int, typer.Option(help="Seed of the scene.")] = 0,
    host: HostOption = "127.0.0.1",
    port: PortOption = None,
    device: Annotated[
        str | None,
        typer.Option(
            help="A device beside the page's handles: keyboard, stream, spacemouse, "
            "gamepad, dualsense, mjgui, or yours: module:Class."
        ),
    ] = None,
    device_option: DeviceOptions = None,
    scale: ScaleOption = 1.0,
    mirror: MirrorOption = False,
    record: Annotated[
        Path | None,
        typer.Option(help="File that the page's button Record adds episodes to."),
    ] = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Move a robot's hands, head, feet and base by dragging them in a web page."""
    import wbc_suite
    from wbc_suite.recording.desk import RecordingDesk
    from wbc_suite.wrappers import DataCollection

    make = None if device is None else device_maker(device, device_option)
    stages = stages_of(device=device is not None, scale=scale, mirror=mirror)
    print(f"Building {benchmark} with {robots} ...", flush=True)
    env: gymnasium.Env[Any, Any] = wbc_suite.make(
        benchmark,
        robots=robots,
        controller_configs=controller,
        gripper_types=chosen(gripper),
        base_types=base,
        control_freq=rate,
        horizon=round(ONE_DAY * rate),
        skin=skin,
    )
    desk = None
    chosen_device = None if make is None else make(env)
    if record is not None:
        collection = DataCollection(env, record, automatic=False)
        env, desk = collection, RecordingDesk(collection.recorder, seed=seed)
    try:
        drive(
            env,
            names=(robots, benchmark),
            rate=rate,
            seed=seed,
            address=(host, port),
            device=chosen_device,
            stages=stages,
            desk=desk,
        )
    finally:
        env.close()
