"""`wbc-suite record`: demonstrations into a file."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wbc_suite.cli import options
from wbc_suite.cli.output import print
from wbc_suite.cli.teleop import ONE_DAY, run_session

if TYPE_CHECKING:
    from wbc_suite.evaluation.generation import Plan

BY_POLICY, BY_HAND = 20.0, 100.0  # Hz; an operator notices a latency of 50 ms
SHOWN = 10  # episodes without success


OutOption = Annotated[
    Path, typer.Option("--out", "-o", help="File; new episodes are added to it.")
]
PolicyOption = Annotated[
    str,
    typer.Option(
        help="Policy: expert, random, hold, FILE.hdf5 (see multiply) or your own "
        "module:function; or an input device: headset, keyboard, stream, spacemouse, "
        "gamepad or dualsense (move while L1 is held), mjgui or your own module:Class."
    ),
]
RateOption = Annotated[
    float | None,
    typer.Option(help="Actions per second; default 20, with a device 100."),
]
OnlySuccessOption = Annotated[
    bool, typer.Option("--only-success", help="Discard episodes that fail.")
]
NextObsOption = Annotated[
    bool, typer.Option("--next-obs", help="Store observations after actions too.")
]
NoiseOption = Annotated[
    float,
    typer.Option(
        min=0.0,
        help="Standard deviation of noise on actions, in full steps (5 cm, 0.5 rad); "
        "the policy's own actions are recorded as `intended`.",
    ),
]
RecoveriesOption = Annotated[
    float,
    typer.Option(
        min=0.0,
        max=100.0,
        help="Mean number of pushes of the hands in 100 actions, which the policy "
        "corrects; marked as `disturbed`.",
    ),
]
PageOption = Annotated[bool, typer.Option(help="Serve a page that shows the scene.")]


def record(
    benchmark: Annotated[str, typer.Argument(help="Benchmark to record.")] = "Lift",
    *,
    out: OutOption,
    robots: options.RobotsOption = None,
    device: PolicyOption = "expert",
    episodes: Annotated[int, typer.Option(min=1, help="Episodes to keep.")] = 10,
    controller: options.ControllerOption = None,
    horizon: options.HorizonOption = None,
    rate: RateOption = None,
    seed: Annotated[int, typer.Option(min=0, help="First seed.")] = 0,
    only_success: OnlySuccessOption = False,
    next_obs: NextObsOption = False,
    noise: NoiseOption = 0.0,
    recoveries: RecoveriesOption = 0.0,
    executor: options.ExecutorOption = "process",
    workers: options.WorkersOption = None,
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
    """Record episodes in robomimic's HDF5 layout; each is safe once it is kept.

    Episodes of a policy are divided among processes or a cluster. A stopped command
    continues if it is run again. Example: wbc-suite record Lift --episodes 1000
    --only-success --noise 0.1 --recoveries 3 -o lift.hdf5
    """
    from wbc_suite.benchmark import load_benchmark
    from wbc_suite.devices import DEVICES, is_device
    from wbc_suite.evaluation.generation import Plan
    from wbc_suite.recording.episode_control import RecordingPlan

    by_hand = is_device(device)
    rate = rate or (BY_HAND if by_hand else BY_POLICY)
    arguments = options.environment_arguments(
        benchmark,
        robots=robots,
        controller=controller,
        gripper=gripper,
        base=base,
        horizon=round(ONE_DAY * rate) if by_hand else horizon,
        policies=[] if by_hand else [device],
        devices=DEVICES,
    )
    arguments |= options.camera_arguments(camera, size)
    arguments |= {"control_freq": rate, "terminate_on_success": not by_hand}
    common: dict[str, Any] = {"benchmark": benchmark, "arguments": arguments}
    if not by_hand:
        plan = Plan(
            **common,
            policy=device,
            only_success=only_success,
            next_obs=next_obs,
            noise=noise,
            pushes=recoveries,
        )
        record_policy(plan, out, episodes, seed, executor=executor, workers=workers)
        return
    kept = run_session(
        **common,
        robots=options.robot_names(robots or load_benchmark(benchmark).robots),
        address=(host, port) if page else None,
        device=device,
        device_options=device_option,
        stages={"scale": scale, "mirror": mirror},
        seed=seed,
        out=out,
        next_obs=next_obs,
        plan=RecordingPlan(
            episodes=episodes, horizon=horizon, only_success=only_success
        ),
    )
    print(f"{out}: {kept} episodes.")


def record_policy(
    plan: "Plan",
    out: Path,
    episodes: int,
    seed: int,
    *,
    executor: str,
    workers: int | None,
) -> None:
    """Record episodes of a policy; print how many succeeded, and which did not."""
    from wbc_suite.evaluation import success_interval
    from wbc_suite.evaluation.generation import generate
    from wbc_suite.executors import make_executor

    with options.progress("Episodes", episodes) as advance:
        found = generate(
            plan,
            out,
            episodes=episodes,
            first_seed=seed,
            executor=make_executor(executor, workers=workers),
            on_kept=advance,
        )
    failed = [each for each in found.played if not each["success"]]
    for each in failed[:SHOWN]:
        reason = each["physics_error"] or each["failure"] or "no success"
        print(f"  seed {each['seed']}: {reason} in {each['steps']} actions")
    if len(failed) > SHOWN:
        print(f"  and {len(failed) - SHOWN} more")
    wins, played = found.successes, len(found.played)
    low, high = (100.0 * share for share in success_interval(wins, played))
    print(
        f"{out}: {found.total} episodes, {found.kept} of them new. {wins} of {played} "
        f"succeeded ({wins / played:.1%}, 95 % interval {low:.1f} to {high:.1f} %)."
    )
    if found.kept < episodes:
        print(f"Too few successes: kept {found.kept} of {episodes}.", file=sys.stderr)
