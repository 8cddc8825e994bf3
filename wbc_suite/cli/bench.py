"""`wbc-suite bench`: how fast environments are on this machine."""

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wbc_suite.cli import options
from wbc_suite.cli.output import print

if TYPE_CHECKING:
    from wbc_suite.envs import RobotEnv
    from wbc_suite.typing import Vector

BLOCKS = 5  # of steps, with a reset before each
RESETS, PICTURES = 20, 50  # that are timed
SHARE = 0.05  # of the way from what holds the robot to a random action


def bench(
    benchmark: Annotated[str, typer.Argument(help="Benchmark to step.")] = "Lift",
    *,
    robots: options.RobotsOption = None,
    controller: options.ControllerOption = None,
    rate: Annotated[float, typer.Option(help="Actions per second, Hz.")] = 20.0,
    actions: Annotated[int, typer.Option(min=BLOCKS, help="Actions to time.")] = 200,
    camera: options.CamerasOption = None,
    size: options.PictureSizeOption = 84,
    output: Annotated[
        Path | None, typer.Option("--json", help="Also write the times to this file.")
    ] = None,
    gripper: options.GripperOption = None,
    base: options.BaseOption = None,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Time an environment's steps, resets and images, and compare with raw physics.

    Times are CPU times, which other programs affect little. Example:
    wbc-suite bench Door --robots GR1 --controller WHOLE_BODY_IK --camera agentview
    """
    import numpy as np

    import wbc_suite
    from wbc_suite.atomic_files import write_bytes
    from wbc_suite.envs import RobotEnv
    from wbc_suite.timing import time_frames

    arguments = options.environment_arguments(
        benchmark,
        robots=robots,
        controller=controller,
        gripper=gripper,
        base=base,
        horizon=10**9,
    )
    arguments |= {"control_freq": rate}
    env = wbc_suite.make(benchmark, **arguments).unwrapped
    assert isinstance(env, RobotEnv), "`make` made it"
    found = _times(env, actions)
    for name in camera or ():
        draw = partial(env.cameras.image, name, width=size, height=size)
        draw()  # makes the renderer
        times = np.array(time_frames(PICTURES, draw).cpu)
        found[f"picture of {name}, {size} x {size}"] = times
    env.close()
    names = " and ".join(robots or ["Panda"])
    _print_table(f"{benchmark}, {names}, {rate:g} Hz", found)
    if output is not None:
        text = json.dumps({"us": {k: times.tolist() for k, times in found.items()}})
        write_bytes(output, f"{text}\n".encode())


def _times(env: "RobotEnv", actions: int) -> "dict[str, Vector]":
    """Return CPU times of steps, raw physics and resets, us."""
    import numpy as np

    from wbc_suite.timing import Block, time_block, times

    layout, rng = env.action_layout, np.random.default_rng(0)
    simulation, found = env.simulation, Block()
    substeps = env.config.substeps
    env.reset(seed=0)
    env.step(env.hold_action)  # compiles
    for k in range(BLOCKS):
        env.reset(seed=k)
        count, hold = actions // BLOCKS, env.hold_action
        drawn = rng.uniform(layout.low, layout.high, (count, hold.size))
        actions_taken = list(hold + SHARE * (drawn - hold))
        model, data = simulation.model, simulation.data
        found.extend(
            time_block(
                env.step, actions_taken, model=model, data=data, substeps=substeps
            )
        )
    return {
        "step": np.array(found.step),
        f"raw physics, {substeps} steps of it": np.array(found.raw),
        "reset": np.array(times(RESETS, env.reset)),
    }


def _print_table(title: str, found: "dict[str, Vector]") -> None:
    """Print medians, 99th percentiles and rates; then the ratio of step to physics."""
    import numpy as np
    from rich.console import Console
    from rich.table import Table

    table = Table("", "median, ms", "99 %, ms", "per second", title=title)
    for column in table.columns[1:]:
        column.justify = "right"
    for name, times in found.items():
        median, tail = np.percentile(times, [50, 99]) / 1e3
        rate = f"{1e3 / median:,.0f}" if median else "-"  # a clock of whole ticks
        table.add_row(name, f"{median:.3f}", f"{tail:.3f}", rate)
    Console().print(table)
    step, raw, *_ = (float(np.median(times)) for times in found.values())
    if raw:
        print(f"A step takes {step / raw:.2f} times as long as its raw physics.")
