"""`wbc-suite multiply`: many demonstrations from few."""

from typing import Annotated

import typer

from wbc_suite.cli import options
from wbc_suite.cli.record import NextObsOption, NoiseOption, OutOption, record_policy

OF_ROBOTS = ("robots", "controller_configs", "gripper_types", "base_types")


def multiply(
    file: options.RecordingArgument,
    *,
    out: OutOption,
    episodes: Annotated[int, typer.Option(min=1, help="Episodes to keep.")] = 1000,
    robots: options.RobotsOption = None,
    controller: options.ControllerOption = None,
    gripper: options.GripperOption = None,
    base: options.BaseOption = None,
    benchmark: Annotated[
        str | None,
        typer.Option(help="Variant of the benchmark, by name or file."),
    ] = None,
    horizon: options.HorizonOption = None,
    noise: NoiseOption = 0.05,
    seed: Annotated[int, typer.Option(min=0, help="First seed.")] = 100_000,
    next_obs: NextObsOption = False,
    executor: options.ExecutorOption = "process",
    workers: options.WorkersOption = None,
    trust_files: options.TrustFilesOption = False,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Make many demonstrations from few, in new scenes, by the method of MimicGen.

    Recorded episodes are divided where fingers start or stop holding an object. The
    segments are moved with their objects to a new scene, joined, and executed with
    noise on the actions. Only episodes that succeed are kept; their share is printed.
    --robots does the same with the hands of other robots. A stopped command continues
    if it is run again.

    Example: wbc-suite record Stack --episodes 10 --only-success -o ten.hdf5; wbc-suite
    multiply ten.hdf5 --episodes 1000 -o thousand.hdf5
    """
    from wbc_suite.evaluation.generation import Plan
    from wbc_suite.recording import Dataset, EnvSource, rebuild

    with Dataset(file) as dataset:
        source = EnvSource.parse(str(dataset.header.get("env_args", "")))
        env = rebuild(dataset, trust_files=trust_files)  # refuses what must not be made
        env.close()
    asked, recorded = benchmark or source.benchmark, dict(source.arguments)
    if robots:
        recorded = {k: v for k, v in recorded.items() if k not in OF_ROBOTS}
    own = recorded.get("robots", [])
    given = options.environment_arguments(
        asked,
        robots=robots or ([own] if isinstance(own, str) else own),
        controller=controller,
        gripper=gripper,
        base=base,
        horizon=horizon,
    )
    plan = Plan(
        benchmark=asked,
        arguments=recorded | given | {"terminate_on_success": True},
        policy=str(file.resolve()),
        noise=noise,
        next_obs=next_obs,
    )
    record_policy(plan, out, episodes, seed, executor=executor, workers=workers)
