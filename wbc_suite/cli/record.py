"""`wbc-suite record`: demonstrations into a file."""

import sys
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
    chosen,
)
from wbc_suite.cli.serving import HostOption, PortOption

if TYPE_CHECKING:
    from wbc_suite.wrappers import DataCollection

__all__ = ["record"]

BY_POLICY, BY_HAND = 20.0, 100.0
"""Hz; a person feels what a policy does not: 20 Hz are 50 ms late at the worst."""


def record(
    benchmark: Annotated[str, typer.Argument(help="Benchmark to record.")] = "Lift",
    *,
    out: Annotated[
        Path,
        typer.Option("--out", "-o", help="File; episodes are added to those in it."),
    ],
    robots: Annotated[
        list[str] | None, typer.Option(help="Robot; repeat it for several.")
    ] = None,
    device: Annotated[
        str,
        typer.Option(
            help="What drives: scripted, random, hold, or yours: module:function; or a "
            "person with a device: keyboard, stream, spacemouse, gamepad, dualsense, "
            "mjgui, or yours: module:Class."
        ),
    ] = "scripted",
    episodes: Annotated[int, typer.Option(min=1, help="How many to keep.")] = 10,
    controller: Annotated[
        str | None, typer.Option(help="Controller, by name or file.")
    ] = None,
    horizon: Annotated[
        int | None, typer.Option(min=1, help="Actions in an episode at most.")
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(help="Actions per second, Hz: 20, and 100 with a device."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the first episode.")] = 0,
    only_success: Annotated[
        bool, typer.Option("--only-success", help="Discard episodes that fail.")
    ] = False,
    next_obs: Annotated[
        bool, typer.Option("--next-obs", help="Store observations after actions too.")
    ] = False,
    camera: Annotated[
        list[str] | None,
        typer.Option(help="Camera whose pictures are stored; may be repeated."),
    ] = None,
    size: Annotated[
        int, typer.Option(min=8, max=2048, help="Of their pictures, pixels.")
    ] = 84,
    device_option: DeviceOptions = None,
    scale: ScaleOption = 1.0,
    mirror: MirrorOption = False,
    host: HostOption = "127.0.0.1",
    port: PortOption = None,
    page: Annotated[
        bool, typer.Option(help="Serve a page that shows the scene to who drives.")
    ] = True,
    gripper: GripperOption = None,
    base: BaseOption = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Record episodes in robomimic's HDF5 layout; each is safe once it is kept."""
    import wbc_suite
    from wbc_suite.devices import is_device
    from wbc_suite.recording.desk import RecordingDesk, RecordingPlan
    from wbc_suite.wrappers import DataCollection

    by_hand = is_device(device)
    rate = rate or (BY_HAND if by_hand else BY_POLICY)
    arguments: dict[str, Any] = {"control_freq": rate}
    if robots:
        arguments["robots"] = robots[0] if len(robots) == 1 else robots
    if controller or by_hand:
        arguments["controller_configs"] = controller or "WHOLE_BODY_IK"
    if horizon or by_hand:
        arguments["horizon"] = round(ONE_DAY * rate) if by_hand else horizon
    if gripper:
        arguments["gripper_types"] = chosen(gripper)
    if base:
        arguments["base_types"] = base
    if camera:
        arguments |= {"use_camera_obs": True, "camera_names": tuple(camera)}
        arguments |= {"camera_heights": size, "camera_widths": size}
    make = device_maker(device, device_option) if by_hand else None
    env = wbc_suite.make(benchmark, terminate_on_success=not by_hand, **arguments)
    collected = DataCollection(env, out, automatic=False, next_obs=next_obs)
    try:
        if make is None:
            _collect(collected, device, episodes, seed, only_success=only_success)
        else:
            plan = RecordingPlan(
                episodes=episodes, horizon=horizon, only_success=only_success
            )
            recorder = collected.recorder
            desk = RecordingDesk(recorder, seed=seed, plan=plan, tell=_tell)
            drive(
                collected,
                names=(" and ".join(robots or ["Panda"]), benchmark),
                rate=rate,
                seed=seed,
                address=(host, port) if page else None,
                device=make(env),
                stages=stages_of(device=True, scale=scale, mirror=mirror),
                desk=desk,
            )
    finally:
        collected.close()
    print(f"{out}: {collected.recorder.kept} episodes.")


def _tell(words: str) -> None:
    print(f"  {words}", flush=True)


def _collect(
    env: "DataCollection", device: str, episodes: int, seed: int, *, only_success: bool
) -> None:
    """Drive episodes until so many are kept, or twenty times as many were tried."""
    from wbc_suite.envs import RobotEnv
    from wbc_suite.policies import make_policy

    inner = env.unwrapped
    assert isinstance(inner, RobotEnv), "`make` made it"
    kept = 0
    for tried in range(20 * episodes):
        policy = make_policy(device, inner, seed + tried)
        seen, _ = env.reset(seed=seed + tried)
        env.recorder.begin()
        ended, info = False, {}
        while not ended:
            seen, _, terminated, truncated, info = env.step(policy(seen))
            ended = terminated or truncated
        length, success = env.recorder.length, bool(info.get("success"))
        if only_success and not success:
            env.recorder.discard()
            print(f"  seed {seed + tried}: discarded, no success in {length} actions")
            continue
        name, kept = env.recorder.keep(), kept + 1
        result = "success" if success else "no success"
        print(f"  {name}: {length} actions, {result} ({kept} of {episodes})")
        if kept == episodes:
            return
    print(f"Gave up: {kept} of {episodes} episodes succeeded.", file=sys.stderr)
