"""Successes of the experts, and of doing nothing, benchmark by benchmark and robot.

Episodes have seeds that were not used for tuning, from 7000 on. An episode counts as a
success if the benchmark is solved within 500 steps, or 1000 for those with several
objects, or their own horizon for robots on feet. Results are added to
docs/experts.json; `--table` writes that into docs/experts.md, and measures nothing.

Usage: python benchmarks/experts.py [BENCHMARK ...] [--robots R[,R]] [--controller C]
    [--policy expert|hold] [--horizon N] [--seeds 100] [--base 7000] [--quick]
    [--json FILE]
       python benchmarks/experts.py --table
"""

import datetime
import json
import statistics
import sys
from pathlib import Path
from typing import Any

from harness.report import Report, machine, options, write_between

import wbc_suite
from wbc_suite.evaluation import success_interval
from wbc_suite.evaluation.rollouts import run_episode

ROOT = Path(__file__).parent.parent
FOUND = ROOT / "docs" / "experts.json"
PAGE = ROOT / "docs" / "experts.md"
KEYS = ("benchmark", "robots", "controller")
LONG = ("TwoArmTransport", "ToolHang", "NutAssembly", "PickPlace")
ON_FEET = ("Stand", "Reach", "WalkTo", "LocoLift", "Carry")
ALL = (
    *("Lift", "Stack"),
    *("PickPlaceMilk", "PickPlaceBread", "PickPlaceCereal", "PickPlaceCan"),
    *("NutAssemblySquare", "NutAssemblyRound", "Door", "Wipe"),
    *("TwoArmLift", "TwoArmPegInHole", "TwoArmHandover"),
    *LONG,
    *ON_FEET,
    *("NutAssemblySingle", "PickPlaceSingle"),
)


def measure(
    name: str,
    policy: str,
    robots: str | None,
    controller: str | None,
    seeds: range,
    horizon: int | None = None,
) -> dict[str, Any]:
    """Run a policy in a benchmark, and return what it came to."""
    arguments: dict[str, Any] = {}
    if horizon or name not in ON_FEET:
        arguments["horizon"] = horizon or (1000 if name in LONG else 500)
    if robots:
        each = robots.split(",")
        arguments["robots"] = each if len(each) > 1 else robots
    if controller:
        arguments["controller_configs"] = controller
    env = wbc_suite.make(name, terminate_on_success=True, **arguments)
    played = [run_episode(env, env, seed, policy) for seed in seeds]
    env.close()
    steps = [e["steps"] for e in played if e["succeeded"]]
    return {
        "benchmark": name,
        "robots": " and ".join(robot.name for robot in env.robots),
        "controller": controller or "default",
        "policy": policy,
        "horizon": env.horizon,
        "successes": len(steps),
        "episodes": len(played),
        "interval": success_interval(len(steps), len(played)),
        "median_steps": statistics.median(steps) if steps else None,
        "most_steps": max(steps, default=None),
        "failed": [
            e["seed"] for e in played if not e["succeeded"] and policy != "hold"
        ],
        "base": seeds.start,
        "date": datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        "machine": machine(),
        "command": "python " + " ".join(["benchmarks/experts.py", *sys.argv[1:]]),
    }


def case(row: dict[str, Any]) -> tuple[str, ...]:
    """Return what was measured: benchmark, robots, controller and policy."""
    return (*(row[k] for k in KEYS), row.get("policy", "expert"))


def table(rows: list[dict[str, Any]]) -> str:
    """Return the results as a table in Markdown; `hold` is beside the expert."""
    idle = {case(row)[:-1]: row for row in rows if case(row)[-1] == "hold"}
    experts = {case(row)[:-1]: row for row in rows if case(row)[-1] == "expert"}
    lines = [
        "| benchmark | robots | controller | successes | 95 % interval "
        "| steps: median, most | seeds from | date | doing nothing |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for key in experts | idle:
        row, still = experts.get(key), idle.get(key)
        cells = [*key, "", "", "", "", ""]
        if row is not None:
            low, high = (100 * share for share in row["interval"])
            median, most = row["median_steps"], row["most_steps"]
            cells[3] = f"{row['successes']} of {row['episodes']}"
            cells[4] = f"{low:.0f} to {high:.0f} %"
            cells[5] = "" if median is None else f"{median:.0f}, {most}"
            cells[6:] = str(row["base"]), row["date"]
        cells.append(f"{still['successes']} of {still['episodes']}" if still else "")
        lines.append(f"| {' | '.join(cells)} |")
    machines = ", ".join(sorted({row["machine"] for row in rows}))
    return "\n".join([*lines, "", f"Machine: {machines}."])


def write_page(rows: list[dict[str, Any]]) -> None:
    """Write the table into the page of the documentation."""
    write_between(PAGE, table(rows))


def add(row: dict[str, Any]) -> None:
    """Add a result to those known, in place of an earlier one of the same case."""
    known = json.loads(FOUND.read_text("utf-8")) if FOUND.exists() else []
    others = [other for other in known if case(other) != case(row)]
    FOUND.write_text(json.dumps([*others, row], indent=1), "utf-8")


def main() -> None:
    """Measure what the arguments name."""
    parser = options(__doc__, "three seeds of five benchmarks")
    parser.add_argument("benchmarks", nargs="*")
    parser.add_argument("--policy", default="expert", choices=("expert", "hold"))
    parser.add_argument("--robots")
    parser.add_argument("--controller")
    parser.add_argument("--horizon", type=int)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--base", type=int, default=7000)
    parser.add_argument("--table", action="store_true", help="write docs/experts.md")
    given = parser.parse_args()
    if given.table:
        write_page(json.loads(FOUND.read_text("utf-8")))
        return
    report = Report()
    count = 3 if given.quick else given.seeds
    for name in given.benchmarks or (ALL[:2] + ALL[8:11] if given.quick else ALL):
        seeds = range(given.base, given.base + count)
        numbers = given.controller, seeds, given.horizon
        row = measure(name, given.policy, given.robots, *numbers)
        if not given.quick:
            add(row)
        report.rows.append(row | {"case": name, "side": row["robots"]})
        print(table([row]).splitlines()[2], row["failed"] or "", flush=True)
    columns = ("case", "side", "successes", "episodes", "median_steps", "most_steps")
    report.show("Successes of experts", columns)
    report.write(given.json)


if __name__ == "__main__":
    main()
