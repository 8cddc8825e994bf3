"""Generation rates: how many adapted demonstrations succeed in new scenes.

Ten successful episodes of the expert are the sources. Each attempt is one scene, with
the noise of `wbc-suite multiply`; seeds of scenes are those that it takes. Published
rates are those of Mandlekar et al. (2023), "MimicGen", table of data generation rates:
from ten human demonstrations, and of its own scenes. `SquareD1` and `SquareD2` have
larger regions of the nut, where MimicGen also moves the peg.

Results are added to artifacts/benchmarks/multiplication.json; `--table` writes that
into docs/multiplication.md, and measures nothing.

Usage: python benchmarks/multiplication.py [CASE ...] [--attempts 200] [--quick]
    [--json FILE]
       python benchmarks/multiplication.py --table
A case is BENCHMARK, or BENCHMARK:ROBOT for another robot than the sources' Panda.
"""

import datetime
import json
import statistics
import sys
import time
from pathlib import Path
from typing import Any

from harness.report import Report, machine, options, write_between

import wbc_suite
from wbc_suite.evaluation import success_interval
from wbc_suite.evaluation.generation import Plan, generate
from wbc_suite.evaluation.rollouts import run_episode
from wbc_suite.scene.placement import Region, UniformSampler
from wbc_suite.wrappers import Disturbance

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "artifacts" / "benchmarks"
FOUND = FOLDER / "multiplication.json"
PAGE = ROOT / "docs" / "multiplication.md"
PUBLISHED = {
    "Stack": 94.3,
    "NutAssemblySquare": 73.7,
    "SquareD1": 48.9,
    "SquareD2": 31.8,
    "NutAssembly": 50.0,
    "PickPlace": 32.7,
}
CASES = (
    *PUBLISHED,
    *("Lift", "PickPlaceCan", "NutAssemblyRound", "Door", "ToolHang"),
    *("Stack:Sawyer", "Stack:UR5e", "Stack:IIWA"),
    *("TwoArmLift", "TwoArmHandover", "TwoArmTransport"),
)
SQUARES = {
    "SquareD1": Region(x=(-0.115, 0.115), y=(-0.255, 0.255)),
    "SquareD2": Region(x=(-0.2, 0.13), y=(-0.32, 0.32)),
}
"""Regions of the nut, m from the middle of the table; that of D0 is 0.5 x 11.5 cm."""
SOURCES, NOISE, FIRST = 10, 0.05, 100_000
LONG = ("TwoArmTransport", "ToolHang", "NutAssembly", "PickPlace")


def sources(benchmark: str) -> Path:
    """Return the recording of ten episodes of the expert; record it if missing."""
    path = FOLDER / "sources" / f"{benchmark}.hdf5"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        arguments = {
            "robots": ["Panda", "Panda"] if benchmark[:6] == "TwoArm" else "Panda",
            "horizon": 1000 if benchmark in LONG else 500,
            "control_freq": 20.0,
            "terminate_on_success": True,
        }
        plan = Plan(benchmark=benchmark, arguments=arguments)
        generate(plan, path, episodes=SOURCES)
    return path


def placement(region: Region) -> UniformSampler:
    """Return what places the square nut in another region of the table."""
    return UniformSampler(names=["SquareNut"], region=region, origin=(0.0, 0.0, 0.82))


def measure(case: str, attempts: int) -> dict[str, Any]:
    """Return how many attempts of a case succeed, and what they cost."""
    benchmark, _, robot = case.partition(":")
    region = SQUARES.get(benchmark)
    known = "NutAssemblySquare" if region else benchmark
    robots = ["Panda", "Panda"] if benchmark[:6] == "TwoArm" else robot or "Panda"
    policy, horizon = str(sources(known)), 1000 if benchmark in LONG else 500
    env = wbc_suite.make(
        known,
        robots=robots,
        placement_initializer=region and placement(region),
        horizon=horizon,
        terminate_on_success=True,
    )
    disturbed, played = Disturbance(env, noise=NOISE), []
    run_episode(disturbed, env, FIRST - 1, policy)  # reads the sources
    begun = time.thread_time()
    for seed in range(FIRST, FIRST + attempts):
        played.append(run_episode(disturbed, env, seed, policy))
    spent = time.thread_time() - begun
    env.close()
    wins = sum(each["success"] for each in played)
    return {
        "case": case,
        "robots": " and ".join(r.name for r in env.robots),
        "successes": wins,
        "attempts": attempts,
        "interval": success_interval(wins, attempts),
        "published": PUBLISHED.get(case),
        "median_steps": statistics.median(e["steps"] for e in played if e["success"])
        if wins
        else None,
        "cpu_seconds": round(spent / attempts, 3),
        "date": datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        "machine": machine(),
        "command": "python "
        + " ".join(["benchmarks/multiplication.py", *sys.argv[1:]]),
    }


def table(rows: list[dict[str, Any]]) -> str:
    """Return the results as a table in Markdown."""
    lines = [
        "| benchmark | robots | generation rate | 95 % interval | published | steps "
        "(median) | CPU s per attempt | date |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        low, high = (100 * share for share in row["interval"])
        known = "" if row["published"] is None else f"{row['published']:.1f} %"
        steps = "" if row["median_steps"] is None else f"{row['median_steps']:.0f}"
        lines.append(
            f"| {row['case'].partition(':')[0]} | {row['robots']} "
            f"| {row['successes']} of {row['attempts']} | {low:.0f} to {high:.0f} % "
            f"| {known} | {steps} | {row['cpu_seconds']:.2f} | {row['date']} |"
        )
    machines = ", ".join(sorted({row["machine"] for row in rows}))
    commands = ", ".join(sorted({f"`{row['command']}`" for row in rows}))
    return "\n".join([*lines, "", f"Machine: {machines}. Commands: {commands}."])


def write_page(rows: list[dict[str, Any]]) -> None:
    """Write the table into the page of the documentation."""
    rows = sorted(rows, key=lambda row: CASES.index(row["case"]))
    write_between(PAGE, table(rows))


def main() -> None:
    """Measure what the arguments name."""
    parser = options(__doc__, "three attempts of Lift and Stack")
    parser.add_argument("cases", nargs="*")
    parser.add_argument("--attempts", type=int, default=200)
    parser.add_argument("--table", action="store_true", help=f"write {PAGE.name}")
    given = parser.parse_args()
    if given.table:
        write_page(json.loads(FOUND.read_text("utf-8")))
        return
    report = Report()
    for case in given.cases or (("Lift", "Stack") if given.quick else CASES):
        row = measure(case, 3 if given.quick else given.attempts)
        report.rows.append(row | {"side": row["robots"]})
        print(table([row]).splitlines()[2], flush=True)
        if not given.quick:
            known = json.loads(FOUND.read_text("utf-8")) if FOUND.exists() else []
            others = [r for r in known if r["case"] != case]
            FOUND.write_text(json.dumps([*others, row], indent=1), "utf-8")
    columns = ("case", "side", "successes", "attempts", "published", "cpu_seconds")
    report.show("Generation rates", columns)
    report.write(given.json)


if __name__ == "__main__":
    main()
