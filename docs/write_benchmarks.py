"""Run the benchmarks; write the table of goals to docs/benchmarks.md.

`make bench` runs all scripts in `benchmarks/`; with `ARGS=--quick` each takes under a
minute, and `--only env_step` runs one. Everything that they measure is written to
artifacts/benchmarks: NAME.json and NAME.md with all tables, and plots. Ratios that the
page shows are kept in docs/benchmarks.json: a run of one script leaves the others'.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "benchmarks"))

from harness.report import cell, heading, look_up, rows_with  # noqa: E402

FOUND = ROOT / "artifacts" / "benchmarks"
PAGE = ROOT / "docs" / "benchmarks.md"
RATIOS = ROOT / "docs" / "benchmarks.json"
ORDER = (
    "env_step",
    "control_law",
    "tracking",
    "scaling",
    "whole_body_ik",
    "cameras",
)
ALWAYS = {"tracking": ["--plot", str(FOUND / "tracking.png")]}
FULL = {
    "simulation_accuracy": ["--trials", "50"],
    "long_runs": ["--quick"],
    "experts": ["--quick"],
}
"""More arguments of some scripts: in every run, and in full ones.

All of `long_runs` takes an hour, and `experts` half of one, so a full run takes their
quick form.
"""

HEAD = """# Measurements

Written by `make bench`. Each ratio is ours over theirs, from one run in which both
sides took turns; times are CPU times. `make bench-peers` installs the peers. All tables
and plots are written to `artifacts/benchmarks/`.
"""

STEP, RAW = "environment step over robosuite's", "environment step over its raw physics"
GOALS = (
    ("Lift/Panda/OSC_POSE/raw", 1.35, RAW),
    ("Lift/Panda/OSC_POSE/robosuite", 0.09, STEP),
    ("Lift/Panda/JOINT_POSITION/raw", 1.2, RAW),
    ("Lift/Panda/JOINT_POSITION/robosuite", 0.09, STEP),
    ("Lift/GR1/WHOLE_BODY_IK/raw", 2.0, RAW),
    ("Lift/Panda/reset/1ms", 1.0, "reset over 1 ms"),
    ("Lift/Panda/recording/thread", 1.1, "recorded step over one that is not"),
    ("GR1/mink", 0.2, "tick of whole-body IK over mink's"),
    ("Tiago/mink", 0.2, "tick of whole-body IK over mink's"),
    ("GR1/placo", 1.0, "tick of whole-body IK over placo's"),
    ("Tiago/placo", 1.0, "tick of whole-body IK over placo's"),
)
"""Ratios that this project sets itself as goals, at most."""

THREADS = "steps of two threads over those of two processes"
AT_LEAST = (
    ("Lift/Panda/OSC_POSE/threads/processes", 0.95, THREADS),
    ("Lift/GR1/WHOLE_BODY_IK/threads/processes", 0.9, THREADS),
)


def scripts() -> list[Path]:
    """Return all benchmarks, the most telling first."""
    places = {name: k for k, name in enumerate(ORDER)}
    found = (ROOT / "benchmarks").glob("*.py")
    return sorted(found, key=lambda p: (places.get(p.stem, len(ORDER)), p.stem))


def run(script: Path, *, quick: bool) -> None:
    """Run one benchmark; its JSON file goes to artifacts/."""
    FOUND.mkdir(parents=True, exist_ok=True)
    command = [
        sys.executable,
        str(script),
        "--json",
        str(FOUND / f"{script.stem}.json"),
    ]
    command += ALWAYS.get(script.stem, [])
    command += ["--quick"] if quick else FULL.get(script.stem, [])
    print(f"== {script.name}", flush=True)
    subprocess.run(command, check=True, cwd=ROOT)


def reports() -> dict[Path, dict[str, Any]]:
    """Return what scripts have found, as far as they have run."""
    return {
        script: json.loads((FOUND / f"{script.stem}.json").read_text("utf-8"))
        for script in scripts()
        if (FOUND / f"{script.stem}.json").exists()
    }


WORDS = ("case", "side", "ratio", "what", "met")
"""Columns of text."""


def table(head: list[str], rows: list[list[str]]) -> str:
    """Return a table of Markdown; figures stand on the right."""
    lines = [head, ["---" if name in WORDS else "---:" for name in head], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def merged(found: dict[Path, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return value, date, machine and versions of each goal's ratio; write RATIOS."""
    kept = json.loads(RATIOS.read_text("utf-8")) if RATIOS.exists() else {}
    for report in found.values():
        for name, value in report["ratios"].items():
            if name in {goal[0] for goal in GOALS + AT_LEAST}:
                kept[name] = {"found": value, **report["about"]}
    RATIOS.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n", "utf-8")
    return kept


def about(ratios: dict[str, dict[str, Any]]) -> str:
    """Return machines and versions."""
    machines = ", ".join(sorted({note["machine"] for note in ratios.values()}))
    versions: dict[str, str] = {}
    for note in sorted(ratios.values(), key=lambda note: note["date"]):
        versions |= note["versions"]
    packages = ", ".join(f"{name} {version}" for name, version in versions.items())
    return f"Machine: {machines}. Versions: {packages}.\n"


def goals(ratios: dict[str, dict[str, Any]]) -> str:
    """Return the goals beside what was found, and whether they are met.

    What was not measured is empty.
    """
    rows, missed = [], 0
    for words, wanted in (("at most", GOALS), ("at least", AT_LEAST)):
        for name, limit, text in wanted:
            note = ratios.get(name, {})
            found, met = note.get("found"), ""
            if found is not None:
                over = (
                    found / limit - 1.0 if words == "at most" else 1.0 - found / limit
                )
                met = "yes" if over <= 0.0 else f"**no**, by {100.0 * over:.0f} %"
                missed += over > 0.0
            shown = [cell(found), met, note.get("date", "")]
            rows.append([f"`{name}`", text, f"{words} {limit:.3g}", *shown])
    head = ["ratio", "what", "goal", "found", "met", "date"]
    return f"{missed} of {len(rows)} goals are missed.\n\n{table(head, rows)}"


def contents() -> str:
    """Return the list of scripts."""
    lines = ["## Scripts", ""]
    for script in scripts():
        title = script.read_text("utf-8").split('"""')[1].strip().splitlines()[0]
        lines.append(f"- `benchmarks/{script.name}`: {title}")
    return "\n".join(lines) + "\n"


def section(script: Path, report: dict[str, Any]) -> str:
    """Return everything that one benchmark measured, as a page."""
    words = script.read_text("utf-8").split('"""')[1].strip().splitlines()
    text = "\n".join(words[1:]).partition("\nUsage:")[0].strip()
    parts = [f"# {words[0].rstrip('.')}\n", f"`benchmarks/{script.name}`\n", text, ""]
    for shown in report["tables"]:
        columns = shown["columns"]
        rows = [
            [cell(look_up(row, name)) for name in columns]
            for row in rows_with(report["rows"], columns)
        ]
        parts += [f"**{shown['title']}**\n", table([*map(heading, columns)], rows)]
    for image in sorted(FOUND.glob(f"{script.stem}*.png")):
        parts.append(f"![{words[0]}]({image.name})\n")
    if report["ratios"]:
        rows = [[f"`{name}`", cell(value)] for name, value in report["ratios"].items()]
        ratios = table(["ratio", "ours / theirs"], rows)
        parts.append(f"**Ratios**\n\n{ratios}")
    return "\n".join(parts)


def draw_env_step(report: dict[str, Any], path: Path) -> None:
    """Draw what a step costs on both sides, and their raw physics."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    rows = [row for row in report["rows"] if row.get("raw_us")]
    cases = list(dict.fromkeys(row["case"] for row in rows))
    figure, axes = pyplot.subplots(figsize=(9, 0.8 + 0.7 * len(cases)))
    for row in rows:
        ours = row["side"] == "ours"
        y, colour = (
            cases.index(row["case"]) + (-0.2 if ours else 0.2),
            "C0" if ours else "C1",
        )
        total, raw = row["median_us"] / 1e3, row["raw_us"] / 1e3
        axes.barh(y, total, 0.36, color=colour, label=row["side"])
        axes.barh(y, raw, 0.36, color="0.3", alpha=0.6, label="its raw physics")
        axes.text(
            total, y, f" {total:.2f} ms, {total / raw:.2f} x", va="center", size=8
        )
    axes.set_yticks(range(len(cases)), cases)
    axes.invert_yaxis()
    axes.set(xlabel="ms of CPU time for one step at 20 Hz (25 physics steps)")
    axes.margins(x=0.28)
    handles, labels = axes.get_legend_handles_labels()
    legend = dict(zip(labels, handles, strict=True))
    axes.legend(list(legend.values()), list(legend), fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=80)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", nargs="*", help="run these scripts; none: no script")
    arguments = parser.parse_args()
    for script in scripts():
        if arguments.only is None or script.stem in arguments.only:
            run(script, quick=arguments.quick)
    found = reports()
    for script, report in found.items():
        if script.stem == "env_step":
            draw_env_step(report, FOUND / "env_step.png")
        text = section(script, report)
        (FOUND / f"{script.stem}.md").write_text(text, encoding="utf-8")
    ratios = merged(found)
    parts = [HEAD, about(ratios), goals(ratios), contents()]
    PAGE.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
