"""`wbc-suite rollout`: many episodes, on all processors or a cluster."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wbc_suite.cli.options import CatalogueOption, ExecutorOption, progress, write_file

if TYPE_CHECKING:
    from wbc_suite.evaluation import Case, Summary
    from wbc_suite.executors import Outcome, WorkItem


def rollout(
    benchmarks: Annotated[list[str], typer.Argument(help="Benchmarks, one or more.")],
    robots: Annotated[
        list[str],
        typer.Option(
            help="Robot; a,b for two in one scene. Repeat it to compare.",
            default_factory=lambda: ["Panda"],
            show_default="Panda",
        ),
    ],
    controller: Annotated[
        list[str] | None,
        typer.Option(help="Controller, by name or file. Repeat it to compare."),
    ] = None,
    policy: Annotated[
        str, typer.Option(help="expert, random, hold, or module:function.")
    ] = "random",
    episodes: Annotated[int, typer.Option(min=1, help="Per case.")] = 10,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first.")] = 0,
    horizon: Annotated[
        int | None, typer.Option(min=1, help="Steps of an episode at most.")
    ] = None,
    shaped: Annotated[bool, typer.Option(help="Shaped rewards.")] = False,
    record: Annotated[
        bool,
        typer.Option("--record", help="Record them: one HDF5 file per item of work."),
    ] = False,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Folder of the results; goes on there."),
    ] = Path("artifacts/rollout"),
    executor: ExecutorOption = "process",
    workers: Annotated[
        int | None, typer.Option(min=1, help="At once; one per processor by default.")
    ] = None,
    chunk: Annotated[int, typer.Option(min=1, help="Episodes per item of work.")] = 10,
    catalogue: CatalogueOption = None,
) -> None:
    """Play many episodes and count successes; stop and go on whenever you like.

    Example: wbc-suite rollout Lift Door --robots Panda --robots UR5e --episodes 100
    """
    from wbc_suite.evaluation import plan_rollouts, run_rollouts
    from wbc_suite.executors import make_executor, run_items

    arguments: dict[str, str | int | float | bool] = {"reward_shaping": shaped}
    if horizon is not None:
        arguments["horizon"] = horizon
    cases = _cases(benchmarks, robots, controller, policy, arguments, record=record)
    seeds = range(first_seed, first_seed + episodes)
    items = {case: plan_rollouts([case], seeds=seeds, chunk=chunk) for case in cases}
    every = [item for mine in items.values() for item in mine]
    with progress("Rollouts", len(every)) as advance:
        outcomes = run_items(
            run_rollouts,
            every,
            folder=output,
            executor=make_executor(executor, workers=workers),
            on_outcome=lambda item, outcome: _finish(item, outcome, advance),
        )
    _report(items, outcomes, output)


def _finish(
    item: "WorkItem", outcome: "Outcome", advance: Callable[[int], None]
) -> None:
    if outcome.error is not None:
        print(f"{item.name}: {outcome.error}")
    advance(1)


def _cases(
    benchmarks: Sequence[str],
    robots: Sequence[str],
    controllers: Sequence[str] | None,
    policy: str,
    arguments: dict[str, str | int | float | bool],
    *,
    record: bool,
) -> "list[Case]":
    """Return every combination; raise an error at once for an unknown robot."""
    from wbc_suite import load_robot
    from wbc_suite.evaluation import Case

    for name in {name.strip() for together in robots for name in together.split(",")}:
        load_robot(name)
    return [
        Case(
            benchmark=benchmark,
            robots=tuple(name.strip() for name in together.split(",")),
            controller=controller,
            policy=policy,
            record=record,
            arguments=tuple(sorted(arguments.items())),
        )
        for benchmark in benchmarks
        for together in robots
        for controller in controllers or [None]
    ]


def _report(
    items: "dict[Case, list[WorkItem]]", outcomes: "list[Outcome]", output: Path
) -> None:
    """Print a table and write summary.json; fail when an item failed."""
    from wbc_suite.evaluation import episodes_of, summarise

    by_name = {outcome.name: outcome for outcome in outcomes}
    summaries: dict[str, Summary] = {}
    for case, mine in items.items():
        if played := episodes_of(by_name[item.name] for item in mine):
            summaries[case.title] = summarise(played)
    _print_table(summaries)
    path = output / "summary.json"
    figures = {title: asdict(summary) for title, summary in summaries.items()}
    text = json.dumps(figures, indent=1) + "\n"
    write_file(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    print(f"Written: {path}; every episode is in {output / 'results'}.")
    failed = sum(outcome.error is not None for outcome in outcomes)
    if failed:
        count = f"{failed} of {len(outcomes)}"
        print(f"{count} items failed; the same command does them again.")
        raise typer.Exit(1)


def _print_table(summaries: "dict[str, Summary]") -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("case", "episodes", "success", "95 %", "return", "steps", "steps/s")
    for title, s in summaries.items():
        low, high = s.interval
        shares = f"{s.success:.1%}", f"{low:.1%} to {high:.1%}"
        broken = f" ({s.physics_errors} broken)" if s.physics_errors else ""
        steps = f"{s.mean_steps:.0f}{broken}", f"{s.steps_per_second:.0f}"
        table.add_row(title, str(s.episodes), *shares, f"{s.mean_return:.3g}", *steps)
    Console().print(table)
