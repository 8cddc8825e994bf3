"""Exported models of every benchmark in mujoco_warp and MJX on the CPU, against MuJoCo.

Each case is a benchmark with its usual robots or one of `ROBOTS`. Both engines start in
the state after a first action of zeros, and keep its controls for 100 steps.

Rows are added to docs/accelerators.json, in place of older ones of the same case and
engine; `--table` writes docs/accelerators.md from it, and runs nothing.

Usage: python benchmarks/accelerators.py [CASE ...] [--engine warp] [--steps 100]
           [--timeout S] [--quick] [--json FILE]
       python benchmarks/accelerators.py --table
A case is BENCHMARK, or BENCHMARK-ROBOT for one of the other robots. NUMBA_DISABLE_JIT=1
avoids compiling control loops that run for one action only.
"""

import datetime
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

from harness.engines import PYTHON, VARIANTS, step_in, write_models
from harness.report import Report, cell, machine, options, write_between
from harness.trials import Case

from wbc_suite.cli.options import tracked
from wbc_suite.errors import WbcError
from wbc_suite.registration import WITH_ID

ROOT = Path(__file__).parent.parent
FOUND = ROOT / "docs" / "accelerators.json"
PAGE = ROOT / "docs" / "accelerators.md"
ROBOTS = ("GR1", "SpotWithArm", "Tiago")
WALKING = "GR1FreeBody"
"""GR1 as it walks, where it is not the usual robot and GR1 on its stand is refused."""
CASES = (
    *WITH_ID,
    *(f"{name}-{robot}" for robot in ROBOTS for name in WITH_ID),
    *(f"{name}-{WALKING}" for name in ("LocoLift", "WalkTo")),
)
ENGINES = {"warp": "mujoco_warp", "mjx": "MJX"}
Row = dict[str, Any]


def measure(case: str, engine: str, folder: Path, steps: int, timeout: float) -> Row:
    """Step one case in one engine; say why where it is not possible."""
    benchmark, _, robot = case.partition("-")
    row: Row = {"case": case, "side": engine, "steps": steps}
    row |= {"date": f"{datetime.datetime.now(tz=datetime.UTC):%Y-%m-%d}"}
    row |= {"machine": machine()}
    try:
        env = Case(benchmark=benchmark, robots=(robot,) if robot else ()).make()
    except WbcError as error:
        return row | {"not_made": str(error)}
    write_models(env, folder, case)
    env.close()
    try:
        found = step_in(engine, folder, [case], steps=steps, timeout=timeout)[case]
    except subprocess.TimeoutExpired:
        return row | {"refused": f"not in {timeout:.0f} s"}
    except subprocess.CalledProcessError as error:
        return row | {"refused": f"ended with {error.returncode}"}
    return row | (found if isinstance(found, dict) else {"refused": found})


def write_page(rows: list[Row]) -> None:
    """Write what each engine found, and why some cases do not exist."""
    for engine in ENGINES:
        if found := {row["case"]: row for row in rows if row["side"] == engine}:
            write_between(PAGE, table(engine, found), marks(engine))
    refused = {row["case"]: row["not_made"] for row in rows if "not_made" in row}
    lines = [
        f"- {', '.join(case for case in refused if refused[case] == why)}: {why}"
        for why in dict.fromkeys(refused.values())
    ]
    write_between(PAGE, "\n".join(lines), marks("refused"))


def marks(part: str) -> tuple[str, str]:
    """Return the marks of a part of the page."""
    return f"<!-- {part} -->", f"<!-- end of {part} -->"


def table(engine: str, found: dict[str, Row]) -> str:
    """Return the results of an engine in Markdown."""
    stepped = [row for row in found.values() if "all" in row]
    lines = [f"{ENGINES[engine]}, {len(stepped)} cases. {costs(stepped)}", ""]
    lines.append("| benchmark | " + " | ".join(["usual robots", *ROBOTS]) + " |")
    lines.append("|---|" + "---|" * (1 + len(ROBOTS)))
    for benchmark in WITH_ID:
        cases = benchmark, *robot_cases(benchmark)
        cells = [shown(found.get(case)) for case in cases]
        lines.append(f"| {benchmark} | " + " | ".join(cells) + " |")
    about = {f"{row['date']}, {row['machine']}" for row in found.values()}
    command = f"`python benchmarks/accelerators.py --engine {engine}`"
    return "\n".join([*lines, "", f"{command}, {' and '.join(sorted(about))}."])


def costs(rows: list[Row]) -> str:
    """Return what the first step, with its compilation, and the others cost."""
    first = [row["first_step_s"] for row in rows]
    others = [row["other_steps_s"] for row in rows]
    return (
        f"CPU time: {median(first):.0f} s in the median for the first step, which "
        f"compiles ({max(first):.0f} s at most), {median(others):.1f} s for the others "
        f"({max(others):.1f} s); at most {max(row['peak_mb'] for row in rows)} MB."
    )


def robot_cases(benchmark: str) -> list[str]:
    """Return the cases of one benchmark with other robots than the usual ones."""
    cases = [f"{benchmark}-{robot}" for robot in ROBOTS]
    walking = f"{benchmark}-{WALKING}"
    return [walking, *cases[1:]] if walking in CASES else cases


def shown(row: Row | None) -> str:
    """Return both differences of a row, or why there are none."""
    if row is None:
        return ""
    if "not_made" in row:
        return "refused"
    found = [cell(row[key]) for key in ("apart", "all") if key in row]
    return ", ".join(found) or row["refused"]


def kept() -> list[Row]:
    """Return the rows that were found before."""
    return json.loads(FOUND.read_text("utf-8"))["rows"] if FOUND.exists() else []


def main() -> None:
    """Measure what the arguments name."""
    parser = options(__doc__, "Door and Lift, 10 steps")
    parser.add_argument("cases", nargs="*", metavar="CASE", help="default: all")
    parser.add_argument("--engine", choices=VARIANTS, default="warp")
    parser.add_argument("--steps", type=int, default=100, help="0 loads the model only")
    parser.add_argument("--timeout", type=float, default=900.0, help="of a case, s")
    parser.add_argument("--table", action="store_true", help=f"write {PAGE.name}")
    given = parser.parse_args()
    order = [(case, engine) for engine in VARIANTS for case in CASES]
    if given.table:
        write_page(kept())
        return
    if not PYTHON.exists():
        sys.exit("not installed: make .venv-accelerators/.installed")
    cases = ("Door", "Lift") if given.quick else given.cases or CASES
    steps = 10 if given.quick else given.steps
    report, rows = Report(), {(row["case"], row["side"]): row for row in kept()}
    for case in tracked(cases, "Cases"):
        with tempfile.TemporaryDirectory() as folder:
            row = measure(case, given.engine, Path(folder), steps, given.timeout)
        rows[case, given.engine] = row
        report.rows = sorted(
            rows.values(), key=lambda row: order.index((row["case"], row["side"]))
        )
        report.write(FOUND if given.json is None else given.json)
    report.show("positions beside MuJoCo", ["case", "side", "nv", "apart", "all"])


if __name__ == "__main__":
    main()
