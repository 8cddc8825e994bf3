"""`wbc-suite record`: demonstrations into a file."""

import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wbc_suite.cli import options
from wbc_suite.cli.teleop import (
    ONE_DAY,
    default_controller,
    device_maker,
    drive,
    stages_of,
)

if TYPE_CHECKING:
    from wbc_suite.wrappers import DataCollection

BY_POLICY, BY_HAND = 20.0, 100.0  # Hz; an operator notices a latency of 50 ms


OutOption = Annotated[
    Path, typer.Option("--out", "-o", help="File; episodes are added to those in it.")
]
PolicyOption = Annotated[
    str,
    typer.Option(
        help="Policy: expert, random, hold, or yours: module:function; or an input "
        "device: keyboard, stream, spacemouse, gamepad, dualsense, mjgui, or yours: "
        "module:Class."
    ),
]
HorizonOption = Annotated[
    int | None, typer.Option(min=1, help="Actions in an episode at most.")
]
RateOption = Annotated[
    float | None,
    typer.Option(help="Actions per second, Hz: 20, and 100 with a device."),
]
OnlySuccessOption = Annotated[
    bool, typer.Option("--only-success", help="Discard episodes that fail.")
]
NextObsOption = Annotated[
    bool, typer.Option("--next-obs", help="Store observations after actions too.")
]
PageOption = Annotated[bool, typer.Option(help="Serve a page that shows the scene.")]


def record(
    benchmark: Annotated[str, typer.Argument(help="Benchmark to record.")] = "Lift",
    *,
    out: OutOption,
    robots: options.RobotsOption = None,
    device: PolicyOption = "expert",
    episodes: Annotated[int, typer.Option(min=1, help="How many to keep.")] = 10,
    controller: options.ControllerOption = None,
    horizon: HorizonOption = None,
    rate: RateOption = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the first episode.")] = 0,
    only_success: OnlySuccessOption = False,
    next_obs: NextObsOption = False,
    camera: options.CamerasOption = None,
    size: options.PictureSizeOption = 84,
    device_option: options.DeviceOptions = None,
    scale: options.ScaleOption = 1.0,
    mirror: options.MirrorOption = False,
    host: options.HostOption = "127.0.0.1",
    port: options.PortOption = None,
    page: PageOption = True,
    gripper: options.GripperOption = None,
    base: options.BaseOption = None,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Record episodes in robomimic's HDF5 layout; each is safe once it is kept."""
    import wbc_suite
    from wbc_suite.devices import is_device
    from wbc_suite.recording.episode_control import EpisodeControl, RecordingPlan
    from wbc_suite.wrappers import DataCollection

    by_hand, named = is_device(device), options.robot_names(robots or ["Panda"])
    rate = rate or (BY_HAND if by_hand else BY_POLICY)
    controller = controller or (default_controller(*named) if by_hand else None)
    arguments = options.environment_arguments(
        robots=robots, controller=controller, gripper=gripper, base=base
    )
    arguments |= options.camera_arguments(camera, size) | {"control_freq": rate}
    if horizon or by_hand:
        arguments["horizon"] = round(ONE_DAY * rate) if by_hand else horizon
    make = device_maker(device, device_option) if by_hand else None
    env = wbc_suite.make(benchmark, terminate_on_success=not by_hand, **arguments)
    collected = DataCollection(env, out, automatic=False, next_obs=next_obs)
    plan = RecordingPlan(episodes=episodes, horizon=horizon, only_success=only_success)
    with closing(collected):
        if make is None:
            _collect(collected, device, episodes, seed, only_success=only_success)
        else:
            drive(
                collected,
                names=(" and ".join(named), benchmark),
                rate=rate,
                seed=seed,
                address=(host, port) if page else None,
                device=make(env),
                stages=stages_of(device, scale=scale, mirror=mirror),
                episode_control=EpisodeControl(
                    collected.recorder, seed=seed, plan=plan, report=_print_message
                ),
            )
    print(f"{out}: {collected.recorder.kept} episodes.")


def _print_message(message: str) -> None:
    print(f"  {message}", flush=True)


def _collect(
    env: "DataCollection", device: str, episodes: int, seed: int, *, only_success: bool
) -> None:
    """Drive episodes until so many are kept, or twenty times as many were tried."""
    from wbc_suite.envs import RobotEnv
    from wbc_suite.evaluation.rollouts import run_episode

    inner, recorder, kept = env.unwrapped, env.recorder, 0
    assert isinstance(inner, RobotEnv), "`make` made it"
    for each in range(seed, seed + 20 * episodes):
        played = run_episode(env, inner, each, device, begin=recorder.begin)
        length, success = played["steps"], played["success"]
        if only_success and not success:
            recorder.discard()
            print(f"  seed {each}: discarded, no success in {length} actions")
            continue
        name, kept = recorder.keep(), kept + 1
        result = "success" if success else "no success"
        print(f"  {name}: {length} actions, {result} ({kept} of {episodes})")
        if kept == episodes:
            return
    print(f"Gave up: {kept} of {episodes} episodes succeeded.", file=sys.stderr)
