"""`wbc-suite expert`: let the expert of a benchmark solve it."""

import time
from contextlib import closing
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wbc_suite.cli import options
from wbc_suite.cli.output import print

if TYPE_CHECKING:
    from wbc_suite.envs import RobotEnv


def expert(
    benchmark: Annotated[str, typer.Argument(help="Benchmark.")] = "Lift",
    *,
    robots: options.RobotsOption = None,
    controller: options.ControllerOption = None,
    episodes: Annotated[int, typer.Option(min=1, help="Number of episodes.")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first episode.")] = 0,
    horizon: options.HorizonOption = None,
    view: Annotated[
        bool, typer.Option("--view", help="Show it in the browser, in real time.")
    ] = False,
    gripper: options.GripperOption = None,
    base: options.BaseOption = None,
    catalogue: options.CatalogueOption = None,
) -> None:
    """Run the expert of a benchmark, and count successes.

    Example: wbc-suite expert Stack --robots UR5e --episodes 50
    """
    import statistics

    import wbc_suite
    from wbc_suite.evaluation import summarise
    from wbc_suite.evaluation.rollouts import run_episode

    arguments = options.environment_arguments(
        benchmark,
        robots=robots,
        controller=controller,
        gripper=gripper,
        base=base,
        horizon=horizon,
        policies=["expert"],
    )
    if view:
        arguments["render_mode"] = "human"
    env = wbc_suite.make(benchmark, terminate_on_success=True, **arguments)
    seeds = range(seed, seed + episodes)
    played: list[dict[str, Any]] = []
    with closing(env), options.progress("Episodes", episodes) as advance:
        shown = _in_real_time(env) if view else env
        for each in seeds:
            played.append(run_episode(shown, env, each, "expert"))
            advance(1)
            if not played[-1]["succeeded"]:
                print(f"  seed {each}: no success in {played[-1]['steps']} steps")
    found = summarise(played)
    low, high = (100 * share for share in found.wilson)
    steps = [episode["steps"] for episode in played if episode["succeeded"]]
    names = " and ".join(robot.name for robot in env.robots)
    print(
        f"{env.benchmark.name}, {names}: {len(steps)} of {episodes} succeeded "
        f"(95 % interval {low:.0f} to {high:.0f} %)"
        + (f", in {statistics.median(steps):.0f} steps (median)." if steps else ".")
    )


def _in_real_time(env: "RobotEnv") -> Any:
    """Return the environment with steps that take as long as in the world."""
    import gymnasium

    class RealTime(gymnasium.Wrapper[Any, Any, Any, Any]):
        def step(self, action: Any) -> Any:
            begun = time.perf_counter()
            result = self.env.step(action)
            left = 1.0 / env.config.control_freq - (time.perf_counter() - begun)
            time.sleep(max(0.0, left))
            return result

    return RealTime(env)
