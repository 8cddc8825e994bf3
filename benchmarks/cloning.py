"""Behaviour cloning: success by noise, history and number of episodes.

Episodes of the expert are recorded plain, with noise on actions, with recoveries from
pushes, with both, and with pushes and four times the noise. The scripts of
examples/learning are trained on some of them. Success is that of the last checkpoint,
of the mean of the last five and of the best of them, over the same unseen scenes.
Results are added to docs/learning.json; cases that are in it are not repeated.
`--table` writes docs/learning.md and its plot from it.

Run it in the environment for learning:
    .venv-learning/bin/python benchmarks/cloning.py Lift --data plain both --seeds 3
    .venv-learning/bin/python benchmarks/cloning.py --table

Usage: cloning.py [BENCHMARK ...] [--data KIND ...] [--methods NAME ...]
    [--episodes N ...] [--seeds 3] [--quick] [--json FILE]
"""

import datetime
import itertools
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from harness.report import Report, machine, options, write_between

from wbc_suite.evaluation import success_interval
from wbc_suite.evaluation.generation import Plan, generate

ROOT = Path(__file__).parent.parent
SCRIPTS = ROOT / "examples" / "learning"
DATA = ROOT / "artifacts" / "benchmarks" / "cloning"
FOUND, PAGE = ROOT / "docs" / "learning.json", ROOT / "docs" / "learning.md"
PLOT = ROOT / "docs" / "images" / "cloning.png"
KINDS = {"plain": (0.0, 0.0), "noise": (1.0, 0.0), "recoveries": (0.0, 1.0)}
KINDS |= {"both": (1.0, 1.0), "strong": (4.0, 1.0)}
"""Shares of a benchmark's noise, and of its pushes."""
BENCHMARKS = {
    "Lift": {"noise": 0.05, "pushes": 4.0, "horizon": 100, "steps": 2000},
    "PickPlaceCan": {"noise": 0.05, "pushes": 2.0, "horizon": 400, "steps": 6000},
    "NutAssemblySquare": {"noise": 0.03, "pushes": 4.0, "horizon": 300, "steps": 8000},
}
"""Noise in full steps, pushes in 100 actions; horizon and gradient steps."""
METHODS = ("bc", "bc_history", "diffusion")
SIZES = (20, 40, 100, 200)
KEY = ("benchmark", "data", "method", "episodes", "seed")


def demonstrations(benchmark: str, kind: str, episodes: int) -> Path:
    """Return a recording of the expert; it is made or continued where it is short."""
    path, own = DATA / f"{benchmark}_{kind}.hdf5", BENCHMARKS[benchmark]
    from wbc_suite.recording import Dataset

    known = 0
    if path.exists():
        with Dataset(path) as dataset:
            known = len(dataset.names)
    if known < episodes:
        path.parent.mkdir(parents=True, exist_ok=True)
        noise, pushes = KINDS[kind]
        plan = Plan(
            benchmark=benchmark,
            arguments={"robots": "Panda", "control_freq": 20.0}
            | {"terminate_on_success": True},
            noise=noise * own["noise"],
            pushes=pushes * own["pushes"],
        )
        generate(plan, path, episodes=episodes - known, first_seed=10_000 * known)
    return path


def measure(
    benchmark: str, data: str, method: str, episodes: int, seed: int, given: Any
) -> dict[str, Any]:
    """Train on so many episodes; return success and CPU time.

    `given` has the numbers `evaluate`, of episodes, and `checkpoints` evaluated.
    """
    sys.path.insert(0, str(SCRIPTS))
    import importlib

    import imitation
    import training

    own = BENCHMARKS[benchmark]
    settings = training.read_settings(SCRIPTS / f"{method}.toml")
    steps = own["steps"] * settings.steps // BENCHMARKS["Lift"]["steps"]
    with tempfile.TemporaryDirectory() as folder:
        settings |= {
            "folder": folder,
            "demonstrations": str(demonstrations(benchmark, data, max(SIZES))),
            "benchmark": benchmark,
            "episodes": episodes,
            "horizon": own["horizon"],
            "seed": seed,
            "steps": steps,
            "save_every": steps // 20,
            "keep": given.checkpoints,
            "evaluate": given.evaluate,
        }
        begun, chosen = time.process_time(), importlib.import_module(method).METHOD
        run = imitation.train(training.Settings(settings), chosen)
        trained = time.process_time()
        found = imitation.evaluate(run, chosen)
        run.writer.close()  # else it goes on writing into the folder
    return {
        **dict(zip(KEY, (benchmark, data, method, episodes, seed), strict=True)),
        **found,
        "evaluated": given.evaluate,
        "checkpoints": given.checkpoints,
        "gradient_steps": steps,
        "training_cpu_seconds": round(trained - begun, 1),
        "evaluation_cpu_seconds": round(time.process_time() - trained, 1),
        "date": datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        "machine": machine(),
        "command": "python " + " ".join(["benchmarks/cloning.py", *sys.argv[1:]]),
    }


def known_rows() -> list[dict[str, Any]]:
    """Return the results so far."""
    return json.loads(FOUND.read_text("utf-8"))["cloning"] if FOUND.exists() else []


def grouped(rows: list[dict[str, Any]]) -> dict[tuple[Any, ...], list[dict[str, Any]]]:
    """Return the rows of each case, of all seeds, in the order of the cases."""
    orders = (tuple(BENCHMARKS), tuple(KINDS), METHODS)

    def place(row: dict[str, Any]) -> tuple[Any, ...]:
        named = [o.index(row[k]) for o, k in zip(orders, KEY, strict=False)]
        return (*named, row["episodes"], row["seed"])

    return {
        key: list(each)
        for key, each in itertools.groupby(
            sorted(rows, key=place), lambda row: tuple(row[k] for k in KEY[:4])
        )
    }


def table(rows: list[dict[str, Any]]) -> str:
    """Return the results as a table in Markdown, one line per case."""
    lines = [
        "| benchmark | data | method | episodes | last checkpoint (each seed) "
        "| 95 % interval | mean of last five checkpoints | best | training, CPU s |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for (benchmark, data, method, episodes), each in grouped(rows).items():
        last, mean, best = ([r[k] for r in each] for k in ("last", "mean", "best"))
        n = sum(r["evaluated"] for r in each)
        low, high = success_interval(round(float(np.mean(last)) * n), n)
        seeds = ", ".join(f"{100 * x:.1f}" for x in last)
        of_seeds = f" ({seeds})" if len(last) > 1 else ""
        of_several = ["", ""]
        if min(r["checkpoints"] for r in each) > 1:
            of_several = [
                f"{100 * np.mean(mean):.1f} %",
                f"{100 * np.mean(best):.1f} %",
            ]
        cost = np.mean([r["training_cpu_seconds"] for r in each])
        lines.append(
            f"| {benchmark} | {data} | {method} | {episodes} "
            f"| {100 * np.mean(last):.1f} %{of_seeds} "
            f"| {100 * low:.1f} to {100 * high:.1f} % | {' | '.join(of_several)} "
            f"| {cost:.0f} |"
        )
    counts = sorted({row["evaluated"] for row in rows})
    machines = ", ".join(sorted({row["machine"] for row in rows}))
    dates = sorted({row["date"] for row in rows})
    commands = "\n".join(sorted({row["command"] for row in rows}))
    return "\n".join(
        [
            *lines,
            "",
            f"{' or '.join(map(str, counts))} evaluation episodes of each checkpoint. "
            f"{dates[0]} to {dates[-1]}; machine: {machines}. Commands:",
            f"\n```\n{commands}\n```",
        ]
    )


def draw(rows: list[dict[str, Any]]) -> None:
    """Draw success over the number of episodes, a panel for each benchmark."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    cases = grouped(rows)
    names = [n for n in BENCHMARKS if any(key[0] == n for key in cases)]
    figure, axes = pyplot.subplots(
        1, len(names), figsize=(5.2 * len(names), 3.6), squeeze=False
    )
    for axis, name in zip(axes[0], names, strict=True):
        for data, method in itertools.product(KINDS, METHODS):
            points = [
                (key[3], 100 * np.mean([r["last"] for r in each]))
                for key, each in cases.items()
                if key[:3] == (name, data, method)
            ]
            if points:
                style = {"bc": ":", "bc_history": "-", "diffusion": "--"}[method]
                colour = f"C{list(KINDS).index(data)}"
                label = f"{method}, {data}"
                axis.plot(
                    *zip(*points, strict=True),
                    style,
                    c=colour,
                    label=label,
                    marker="o",
                    ms=4,
                )
        axis.set(
            title=name,
            xlabel="episodes",
            ylabel="success, %",
            xscale="log",
            ylim=(-3, 103),
        )
        axis.set_xticks(SIZES, [str(n) for n in SIZES])
        axis.minorticks_off()
        axis.grid(alpha=0.3)
        axis.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(PLOT, dpi=90)


def write_page(rows: list[dict[str, Any]]) -> None:
    """Write the table into the page of the documentation, and draw its plot."""
    write_between(PAGE, table(rows))
    draw(rows)


def add(row: dict[str, Any]) -> None:
    """Add a result to those known."""
    page = json.loads(FOUND.read_text("utf-8")) if FOUND.exists() else {}
    page["cloning"] = [*page.get("cloning", []), row]
    FOUND.write_text(json.dumps(page, indent=1) + "\n", "utf-8")


def main() -> None:
    """Measure what the arguments name."""
    parser = options(__doc__, "two short trainings for Lift")
    parser.add_argument("benchmarks", nargs="*", metavar="BENCHMARK")
    parser.add_argument("--data", nargs="+", choices=KINDS, default=[*KINDS])
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=METHODS[:2])
    parser.add_argument("--episodes", nargs="+", type=int, default=SIZES)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--evaluate", type=int, default=200)
    parser.add_argument("--checkpoints", type=int, default=5, help="evaluated")
    parser.add_argument("--table", action="store_true", help=f"write {PAGE.name}")
    given = parser.parse_args()
    if given.table:
        write_page(known_rows())
        return
    report = Report()
    if given.quick:
        given.benchmarks, given.data, given.episodes = ["Lift"], ["both"], [20]
        given.seeds, given.evaluate = 1, 10
    seen = {tuple(row[k] for k in KEY) for row in known_rows()}
    for case in itertools.product(
        given.benchmarks or BENCHMARKS,
        given.data,
        given.methods,
        given.episodes,
        range(given.seeds),
    ):
        if given.quick or case not in seen:
            row = measure(*case, given)
            if not given.quick:
                add(row)
            print(table([row]).splitlines()[2], flush=True)
            report.rows.append(row | {"case": case[0], "side": case[2]})
    report.show("Success of cloned policies", ("case", "side", *KEY[1:], "last"))
    report.write(given.json)


if __name__ == "__main__":
    main()
