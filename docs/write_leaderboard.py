"""Write docs/leaderboard.md from what benchmarks/leaderboard.py measured.

Run after it: `python docs/write_leaderboard.py`. The figures are kept in
docs/leaderboard.json, so that the page can be drawn anew without measuring.
"""

import json
import shutil
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "benchmarks"))

from harness.report import cell  # noqa: E402

MEASURED = ROOT / "artifacts" / "benchmarks" / "leaderboard.json"
KEPT, PAGE = ROOT / "docs" / "leaderboard.json", ROOT / "docs" / "leaderboard.md"
COMMAND = (
    "python benchmarks/leaderboard.py --json artifacts/benchmarks/leaderboard.json"
)
COLUMNS = {
    "settling_s": "settling, s",
    "overshoot": "overshoot",
    "error_mm": "error, mm",
    "worst_mm": "circle worst, mm",
    "median_mm": "circle median, mm",
    "tick_us": "tick, us",
    "tick_p99_us": "99 %, us",
    "past_range_mrad": "past range, mrad",
    "past_speed": "past speed",
    "chatter": "chatter, 1/s",
    "energy_J": "energy, J",
}
HEAD = """# Controllers compared

Written by `docs/write_leaderboard.py` from `docs/leaderboard.json`, which
`{command}` measured.

The hand is commanded to move by 5 cm and 20 degrees in three directions, and round a
circle of 20 cm in 4 s. *Settling*, *overshoot* and *error* are the worst of the three;
an empty cell did not settle within 2 s. *Past range* is how far a joint passed its
range at most, *past speed* the share of physics steps in which a joint was faster than
its limit, *chatter* the total variation of the torques, in torque ranges per second and
motor. A *tick* is a physics step with its control law, CPU time of the median and of
the 99th percentile. Rows are in order of the circle's median. OSC_POSITION is sent
positions only; joint controllers are sent the joint angles of the same motion, in
absolute positions, or as the velocities that reach them in one action. On a busy
machine the 99th percentile of ticks is high.

Machine: {machine}. Date: {date}. Versions: {versions}.
"""


def page(report: dict[str, Any]) -> str:
    """Return the page."""
    about = report["about"]
    versions = ", ".join(f"{name} {v}" for name, v in about["versions"].items())
    parts = [
        HEAD.format(
            command=COMMAND,
            machine=about["machine"],
            date=about["date"],
            versions=versions,
        )
    ]
    for robot in dict.fromkeys(row["case"] for row in report["rows"]):
        rows = [row for row in report["rows"] if row["case"] == robot]
        parts.append(f"## {robot}\n\n{table(rows)}{left_out(rows)}")
    return "\n".join(parts)


def table(rows: list[dict[str, Any]]) -> str:
    """Return the table of one robot."""
    measured = sorted(
        (row for row in rows if "left_out" not in row), key=lambda row: row["median_mm"]
    )
    if not measured:
        return ""
    lines = [["controller", *COLUMNS.values()], ["---", *["---:"] * len(COLUMNS)]]
    for row in measured:
        values = [cell(rounded(row.get(name))) for name in COLUMNS]
        lines.append([f"`{row['side']}`", *values])
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def rounded(value: Any) -> Any:
    """Return a figure, and 0 for one that is only a rounding error."""
    return 0.0 if isinstance(value, float) and abs(value) < 5e-4 else value


def left_out(rows: list[dict[str, Any]]) -> str:
    """Return the list of controllers that do not fit the robot, with reasons."""
    lines = [f"- `{r['side']}`: {r['left_out']}" for r in rows if "left_out" in r]
    return "\nLeft out:\n\n" + "\n".join(lines) + "\n" if lines else ""


def main() -> None:
    """Write the page, from new figures if there are any."""
    if MEASURED.exists():
        shutil.copyfile(MEASURED, KEPT)
    report = json.loads(KEPT.read_text(encoding="utf-8"))
    PAGE.write_text(page(report), encoding="utf-8")
    print(f"Written: {PAGE}")


if __name__ == "__main__":
    main()
