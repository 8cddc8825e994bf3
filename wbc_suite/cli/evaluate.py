"""`wbc-suite evaluate`: success rates of policies, on all processors or a cluster."""

import itertools
import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wbc_suite.cli.options import (
    CatalogueOption,
    ExecutorOption,
    HostOption,
    check_names,
    progress,
    robot_names,
    write_file,
)
from wbc_suite.cli.output import print
from wbc_suite.errors import printable

if TYPE_CHECKING:
    from wbc_suite.evaluation import Case
    from wbc_suite.evaluation.results import Results
    from wbc_suite.executors import Outcome, WorkItem

BenchmarksArgument = Annotated[
    list[str],
    typer.Argument(help="One or more benchmarks: names, files or module:Name."),
]
RobotsOption = Annotated[
    list[str],
    typer.Option(
        help="Robot; A,B for two in one scene. Repeat to compare robots.",
        default_factory=list,
        show_default="those of each benchmark",
    ),
]
ControllersOption = Annotated[
    list[str] | None,
    typer.Option(help="Controller, by name or file. Repeat to compare."),
]
PoliciesOption = Annotated[
    list[str],
    typer.Option(
        help="expert, random, hold, module:Name, FILE.hdf5 or socket://HOST:PORT. "
        "Repeat to compare others with the first, scene by scene.",
        default_factory=lambda: ["random"],
        show_default="random",
    ),
]
PerturbOption = Annotated[
    list[str] | None,
    typer.Option(
        help="camera, light, colour, layout, start or wording, or none. Repeat to "
        "compare.",
    ),
]
BaseOption = Annotated[
    int,
    typer.Option(
        "--base-seed",
        min=0,
        help="Seeds are computed from this, the benchmark and the episode.",
    ),
]
FirstSeedOption = Annotated[
    int | None,
    typer.Option(min=0, help="Use consecutive seeds from this one on."),
]
HorizonOption = Annotated[
    int | None, typer.Option(min=1, help="Maximum steps of an episode.")
]
StopOption = Annotated[
    bool, typer.Option("--stop/--no-stop", help="End an episode at its success.")
]
RecordOption = Annotated[
    bool,
    typer.Option("--record", help="Record episodes: an HDF5 file per work item."),
]
OutputOption = Annotated[
    Path,
    typer.Option("--output", "-o", help="Folder of the results."),
]
WorkersOption = Annotated[
    int | None, typer.Option(min=1, help="Workers; one per processor by default.")
]
FilmsOption = Annotated[
    int, typer.Option(min=0, help="Failures of each case to film for the report.")
]
ActionTimeOption = Annotated[
    float,
    typer.Option(min=0.0, help="Most time of the policy for an action, s; 0: any."),
]
EpisodeTimeOption = Annotated[
    float, typer.Option(min=0.0, help="Most time of an episode, s; 0: any.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print only JSON.")]


def evaluate(
    benchmarks: BenchmarksArgument,
    *,
    robots: RobotsOption,
    policy: PoliciesOption,
    controller: ControllersOption = None,
    perturb: PerturbOption = None,
    episodes: Annotated[int, typer.Option(min=1, help="Episodes per case.")] = 400,
    base_seed: BaseOption = 0,
    first_seed: FirstSeedOption = None,
    horizon: HorizonOption = None,
    shaped: Annotated[bool, typer.Option(help="Shaped rewards.")] = False,
    stop: StopOption = True,
    record: RecordOption = False,
    films: FilmsOption = 0,
    action_time: ActionTimeOption = 60.0,
    episode_time: EpisodeTimeOption = 3600.0,
    output: OutputOption = Path("artifacts/evaluation"),
    executor: ExecutorOption = "process",
    workers: WorkersOption = None,
    chunk: Annotated[int, typer.Option(min=1, help="Episodes per work item.")] = 10,
    as_json: JsonOption = False,
    catalogue: CatalogueOption = None,
) -> None:
    """Run many episodes and report success rates; a stopped command can continue.

    An episode in which the policy raises an error, gives an invalid action or takes too
    long is a failure, and its kind of error is reported; the others go on.
    Writes summary.json, eval_info.json (LeRobot's fields) and report.html. Example:
    wbc-suite evaluate Lift Door --robots Panda --robots UR5e --policy my_module:Policy
    """
    from wbc_suite.evaluation import episode_seeds, plan_rollouts, run_rollouts
    from wbc_suite.evaluation.films import film_failures
    from wbc_suite.evaluation.results import collect
    from wbc_suite.evaluation.rollouts import prepare_rollouts
    from wbc_suite.executors import Processes, make_executor, run_items

    begun = time.perf_counter()
    arguments: dict[str, str | int | float | bool] = {"reward_shaping": shaped}
    arguments |= {"terminate_on_success": stop}
    if horizon is not None:
        arguments["horizon"] = horizon
    cases = [
        replace(case, record=record, action_time=action_time, episode_time=episode_time)
        for case in _cases(
            benchmarks, robots, controller, policy, perturb, arguments=arguments
        )
    ]
    items = {}
    for case in cases:
        seeds: Sequence[int] = episode_seeds(case.benchmark, episodes, base=base_seed)
        if first_seed is not None:
            seeds = range(first_seed, first_seed + episodes)
        items[case] = plan_rollouts([case], seeds=seeds, chunk=chunk)
    runner = make_executor(executor, workers=workers)
    if isinstance(runner, Processes) and not any(":" in n for n in policy + benchmarks):
        runner.prepare = prepare_rollouts  # a module of a user's may hold a GPU
    every = [item for mine in items.values() for item in mine]
    with progress("Episodes", sum(len(i.payload["seeds"]) for i in every)) as advance:
        outcomes = run_items(
            run_rollouts,
            every,
            folder=output,
            executor=runner,
            on_outcome=lambda item, outcome: _finish(item, outcome, advance),
        )
    results = collect(items, outcomes, seconds=time.perf_counter() - begun)
    if films:
        drawing = make_executor(executor, workers=workers)
        film_failures(results, most=films, folder=output, executor=drawing)
    _report(results, output, as_json=as_json)


def serve_policy(
    policy: Annotated[
        str, typer.Argument(help="expert, random, hold, module:Name or FILE.hdf5.")
    ],
    *,
    host: HostOption = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port; 0 for any free one.")
    ] = 5555,
    connections: Annotated[
        int, typer.Option(min=1, help="Episodes that are served at a time.")
    ] = 64,
    trust_files: Annotated[
        bool,
        typer.Option("--trust-files", help="Read robot files that clients name."),
    ] = False,
) -> None:
    """Serve a policy to `wbc-suite evaluate --policy socket://HOST:PORT`.

    On 127.0.0.1 every program of this machine can use the policy. To serve a policy
    from your own code, use `wbc_suite.evaluation.PolicyServer`.
    """
    from wbc_suite.evaluation import PolicyServer, replicate

    check_names(policies=[policy])
    begin = replicate(policy, trust_files=trust_files)
    with PolicyServer(begin, host=host, port=port, connections=connections) as server:
        print(f"{policy}: {server.address}\nPress Ctrl-C to stop.", flush=True)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            print("Stopped.")


def _finish(
    item: "WorkItem", outcome: "Outcome", advance: Callable[[int], None]
) -> None:
    if outcome.error is not None:
        print(f"{item.name}: {outcome.error}", file=sys.stderr)
    advance(len(item.payload["seeds"]))


def _cases(
    benchmarks: Sequence[str],
    robots: Sequence[str],
    controllers: Sequence[str] | None,
    policies: Sequence[str],
    perturb: Sequence[str] | None,
    *,
    arguments: dict[str, str | int | float | bool],
) -> "list[Case]":
    """Return every combination; raise an error at once for an unknown name."""
    from wbc_suite.benchmark import BENCHMARKS, load_benchmark
    from wbc_suite.evaluation import PERTURBATIONS, Case

    changes = ["" if name == "none" else name for name in perturb or ["none"]]
    for name in filter(None, changes):
        PERTURBATIONS.find(name)
    check_names(
        benchmarks=benchmarks,
        robots=sorted({*robot_names(robots)}),
        controllers=controllers or (),
        policies=policies,
    )
    spelled = {
        name: BENCHMARKS.spelled(name) for name in benchmarks if name in BENCHMARKS
    }
    teams = {
        name: robots or [",".join(load_benchmark(name).robots)] for name in benchmarks
    }
    every = itertools.product(policies, benchmarks, controllers or [None], changes)
    return [
        Case(
            benchmark=spelled.get(benchmark, benchmark),
            robots=tuple(name.strip() for name in together.split(",")),
            controller=controller,
            policy=policy,
            perturb=change,
            arguments=tuple(sorted(arguments.items())),
        )
        for policy, benchmark, controller, change in every
        for together in teams[benchmark]
    ]


def _report(results: "Results", output: Path, *, as_json: bool) -> None:
    """Print figures and write the files; fail when an item failed."""
    from wbc_suite.evaluation.report import report_page

    figures = results.figures()
    files = {
        "summary.json": json.dumps(figures, indent=1) + "\n",
        "eval_info.json": json.dumps(results.as_lerobot(), indent=2) + "\n",
        "report.html": report_page(results, " ".join(["wbc-suite", *sys.argv[1:]])),
    }
    for name, text in files.items():
        write_file(output / name, partial(Path.write_text, data=text, encoding="utf-8"))
    if as_json:
        print(json.dumps(figures, indent=1))
    else:
        _print_tables(results)
        print(f"Written: {', '.join(files)} in {output}; every episode in results/.")
    if results.failed:
        count = f"{results.failed} of {results.items}"
        text = f"{count} items failed; run the same command to retry them."
        print(text, file=sys.stderr)
        raise typer.Exit(1)


def _print_tables(results: "Results") -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("case", "episodes", "success", "95 %", "return", "steps", "steps/s")
    for case, s in results.summaries.items():
        low, high = s.wilson
        shares = f"{s.success_rate:.1%}", f"{low:.1%} to {high:.1%}"
        broken = f" ({s.physics_errors} diverged)" if s.physics_errors else ""
        broken += "".join(f" ({n} {kind})" for kind, n in s.errors.items())
        steps = f"{s.mean_steps:.0f}{broken}", f"{s.steps_per_second:.0f}"
        row = str(s.episodes), *shares, f"{s.mean_return:.3g}", *steps
        table.add_row(printable(case.title), *row)
    console = Console()
    console.print(table)
    for (first, second), found in results.comparisons.items():
        low, high = found.interval
        print(
            f"{second}, compared with {first}, is {found.verdict}: "
            f"{found.difference:+.1%} ({low:+.1%} to {high:+.1%}) on {found.pairs} "
            f"common scenes, p = {found.p_value:.2g}; at most "
            f"{found.false_alarms:.0%} false alarms."
        )
