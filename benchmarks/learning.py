"""SAC on the nine benchmarks of robosuite's paper, against its published curves.

The table has Panda and Sawyer, two of each for two-armed benchmarks, with OSC_POSE and
JOINT_VELOCITY. Each run is examples/learning/sac.py with its settings, in a folder of
its own under artifacts/learning; a stopped run continues. Results are added to
docs/learning.json; runs that are in it with as many steps are not repeated.
`--table` writes docs/learning.md and its plot from it.

Run it in the environment for learning:
    .venv-learning/bin/python benchmarks/learning.py Lift Door --seeds 3
    .venv-learning/bin/python benchmarks/learning.py --table

Usage: learning.py [BENCHMARK ...] [--robots Panda Sawyer] [--controllers C ...]
    [--seeds 5] [--steps 1250000] [--evaluate 50] [--quick] [--json FILE]
       learning.py --published FOLDER

The last one reads the logs of github.com/ARISE-Initiative/robosuite-benchmark (2020,
five seeds of each) from a copy, and writes benchmarks/peers/sac_published.json.
"""

import csv
import datetime
import itertools
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from harness.report import Report, machine, options, write_between

ROOT = Path(__file__).parent.parent
SCRIPTS = ROOT / "examples" / "learning"
FOUND, PAGE = ROOT / "docs" / "learning.json", ROOT / "docs" / "learning.md"
PLOT = ROOT / "docs" / "images" / "sac.png"
PUBLISHED = ROOT / "benchmarks" / "peers" / "sac_published.json"
MARKS = "<!-- SAC -->", "<!-- end of SAC -->"
BENCHMARKS = (
    *("Lift", "Door", "Stack", "NutAssemblyRound", "PickPlaceCan", "Wipe"),
    *("TwoArmLift", "TwoArmPegInHole", "TwoArmHandover"),
)
CONTROLLERS = ("OSC_POSE", "JOINT_VELOCITY")
SETTINGS = {"Door": {"noise": 0.5}}
"""In place of those in sac.toml. Without it the lever is turned, but never pulled."""
CONTROLLER_OPTIONS = {("Door", "OSC_POSE"): {"kp": 150.0}}
"""150 /s^2 is robosuite's stiffness, and that of the published runs; ours is 400."""
EPOCHS = (5, 10, 20, 30, 50, 75, 100, 150, 200, 250, 300, 350, 400, 450, 500)
KEY = ("benchmark", "robots", "controller", "seed", "steps")


def read_published(folder: Path) -> dict[str, Any]:
    """Return the evaluation returns of each case: means of five epochs, by seed."""
    cases: dict[str, Any] = {}
    for path in sorted(folder.glob("runs/*/*/progress.csv")):
        with path.open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))[: EPOCHS[-1]]
        returns = np.array([float(row["evaluation/Returns Mean"]) for row in rows])
        reached = [epoch for epoch in EPOCHS if epoch <= len(rows)]
        name = path.parts[-3].rpartition("-SEED")[0].replace("Handoff", "Handover")
        case = cases.setdefault(name, {"returns": [], "hours": []})
        case["steps"] = [
            int(float(rows[epoch - 1]["exploration/num steps total"]))
            for epoch in EPOCHS
            if epoch <= len(rows)
        ]
        case["returns"].append(
            [round(float(returns[epoch - 5 : epoch].mean()), 1) for epoch in reached]
        )
        seconds = sum(float(row["time/epoch (s)"]) for row in rows)
        case["hours"].append(round(seconds / 3600, 1))
    source = "github.com/ARISE-Initiative/robosuite-benchmark, progress.csv of each run"
    return {"source": source, "cases": cases}


def published(benchmark: str, robots: str, controller: str) -> dict[str, Any] | None:
    """Return the published curve of a case, if there is one."""
    name = f"{benchmark}-{robots.replace(',', '')}-{controller.replace('_', '-')}"
    return json.loads(PUBLISHED.read_text("utf-8"))["cases"].get(name)


def measure(
    case: tuple[str, str, str, int, int], evaluate: int, folder: Path
) -> dict[str, Any]:
    """Train a case from the last checkpoint in a folder on, and evaluate episodes."""
    benchmark, robots, controller, seed, steps = case
    sys.path.insert(0, str(SCRIPTS))
    import sac
    from training import Settings, read_settings

    name = f"{benchmark}-{robots.replace(',', '')}-{controller}-seed{seed}"
    settings = read_settings(SCRIPTS / "sac.toml")
    settings |= {
        "folder": str(folder / name),
        "benchmark": benchmark,
        "robots": robots.split(",") if "," in robots else robots,
        "controller": {
            "type": controller,
            **CONTROLLER_OPTIONS.get((benchmark, controller), {}),
        },
        "seed": seed,
        "steps": steps,
        "evaluate": evaluate,
        **SETTINGS.get(benchmark, {}),
    }
    settings = Settings(settings)
    model, run = sac.train(settings)
    found = sac.evaluate(settings, lambda o: model.predict(o, deterministic=True)[0])
    path = run / "curve.jsonl"
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    curve = [json.loads(line) for line in lines]
    return {
        **dict(zip(KEY, case, strict=True)),
        "return": round(float(np.mean([total for total, _ in found])), 1),
        "success": float(np.mean([solved for _, solved in found])),
        "evaluated": len(found),
        "hours": hours(curve),
        "curve": curve,
        "settings": dict(settings) | {"folder": name},
        "date": datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        "machine": machine(),
        "command": "python " + " ".join(["benchmarks/learning.py", *sys.argv[1:]]),
    }


def hours(curve: list[dict[str, Any]]) -> float:
    """Return the time of training, also of one that was stopped and continued."""
    seconds = [row["seconds"] for row in curve]
    ends = [a for a, b in itertools.pairwise([*seconds, 0.0]) if b < a]
    return round(sum(ends) / 3600, 2)


def known_rows() -> list[dict[str, Any]]:
    """Return the results so far."""
    page = json.loads(FOUND.read_text("utf-8")) if FOUND.exists() else {}
    return page.get("sac", [])


def add(row: dict[str, Any]) -> None:
    """Add a result to those known."""
    page = json.loads(FOUND.read_text("utf-8")) if FOUND.exists() else {}
    page["sac"] = [*page.get("sac", []), row]
    FOUND.write_text(json.dumps(page, indent=1) + "\n", "utf-8")


def table(rows: list[dict[str, Any]]) -> str:
    """Return the results as a table in Markdown, one line per run."""
    lines = [
        "| benchmark | robots | controller | seed | steps | return | success "
        "| hours (steps/s) | published return at as many steps (five seeds) "
        "| published final return | published hours | date |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        theirs = published(*(row[key] for key in KEY[:3]))
        beside = final = hours = ""
        if theirs:
            curves = _equal(theirs)
            beside = _median(
                [np.interp(row["steps"], theirs["steps"], r) for r in curves]
            )
            final = _median([r[-1] for r in curves])
            hours = (
                f"{np.median(theirs['hours']):.0f} for {theirs['steps'][-1]:,} steps"
            )
        rate = row["steps"] / max(3600 * row["hours"], 1.0)
        lines.append(
            f"| {row['benchmark']} | {row['robots']} | {row['controller']} "
            f"| {row['seed']} | {row['steps']:,} | {row['return']:.0f} "
            f"| {100 * row['success']:.0f} % | {row['hours']:.2f} ({rate:.0f}) "
            f"| {beside} | {final} | {hours} | {row['date']} |"
        )
    machines = ", ".join(sorted({row["machine"] for row in rows}))
    commands = ", ".join(sorted({f"`{row['command']}`" for row in rows}))
    return "\n".join([*lines, "", f"Machine: {machines}. Commands: {commands}."])


def _median(values: list[float]) -> str:
    """Return the median and the range of values."""
    return f"{np.median(values):.0f} ({min(values):.0f} to {max(values):.0f})"


def _equal(theirs: dict[str, Any]) -> list[list[float]]:
    """Return the published curves of the seeds that reached all epochs."""
    return [each for each in theirs["returns"] if len(each) == len(theirs["steps"])]


def draw(rows: list[dict[str, Any]]) -> None:
    """Draw returns over steps by case, with the published median and range."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    cases = list(dict.fromkeys(tuple(row[key] for key in KEY[:3]) for row in rows))
    figure, axes = pyplot.subplots(
        1, len(cases), figsize=(4.8 * len(cases), 3.4), squeeze=False
    )
    for axis, case in zip(axes[0], cases, strict=True):
        if theirs := published(*case):
            low, middle, high = np.quantile(_equal(theirs), (0.0, 0.5, 1.0), axis=0)
            axis.fill_between(theirs["steps"], low, high, color="0.85")
            axis.plot(theirs["steps"], middle, color="0.5", label="published")
        for row in rows:
            if tuple(row[key] for key in KEY[:3]) == case:
                steps, returns = zip(
                    *((c["step"], c["return"]) for c in row["curve"]), strict=True
                )
                axis.plot(steps, returns, label=f"seed {row['seed']}")
        axis.set(title=" ".join(case), xlabel="environment steps", ylabel="return")
        axis.grid(alpha=0.3)
        axis.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(PLOT, dpi=90)


def write_page(rows: list[dict[str, Any]]) -> None:
    """Write the table into the page of the documentation, and draw its plot."""
    write_between(PAGE, table(rows), MARKS)
    draw(rows)


def main() -> None:
    """Measure what the arguments name."""
    parser = options(__doc__, "800 steps of Lift")
    parser.add_argument("benchmarks", nargs="*", metavar="BENCHMARK")
    parser.add_argument("--robots", nargs="+", default=["Panda", "Sawyer"])
    parser.add_argument("--controllers", nargs="+", default=CONTROLLERS)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--steps", type=int, default=1_250_000)
    parser.add_argument("--evaluate", type=int, default=50, help="episodes")
    parser.add_argument("--table", action="store_true", help=f"write {PAGE.name}")
    parser.add_argument("--published", type=Path, metavar="FOLDER")
    given = parser.parse_args()
    if given.published:
        text = json.dumps(read_published(given.published), separators=(",", ":"))
        PUBLISHED.write_text(text + "\n", "utf-8")
        return
    if given.table:
        write_page(known_rows())
        return
    folder = ROOT / "artifacts" / "learning"
    report, seen = Report(), {tuple(row[k] for k in KEY) for row in known_rows()}
    if given.quick:
        given.benchmarks, given.robots = ["Lift"], ["Panda"]
        given.controllers, given.seeds, given.steps = CONTROLLERS[:1], 1, 800
        given.evaluate, folder = 1, Path(tempfile.mkdtemp())
    for benchmark, robot, controller, seed in itertools.product(
        given.benchmarks or BENCHMARKS,
        given.robots,
        given.controllers,
        range(given.seeds),
    ):
        robots = f"{robot},{robot}" if benchmark.startswith("TwoArm") else robot
        case = (benchmark, robots, controller, seed, given.steps)
        if case not in seen:
            row = measure(case, given.evaluate, folder)
            if not given.quick:
                add(row)
            print(table([row]).splitlines()[2], flush=True)
            report.rows.append(row | {"case": benchmark, "side": robots})
    report.show("SAC", ("case", "side", *KEY[2:], "return", "success", "hours"))
    report.write(given.json)


if __name__ == "__main__":
    main()
