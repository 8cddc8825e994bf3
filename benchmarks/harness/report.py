"""Rows and ratios of one benchmark: its options, its table, its JSON file."""

import argparse
import datetime
import json
import platform
from collections.abc import Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

__all__ = [
    "RESULTS",
    "Report",
    "cell",
    "heading",
    "look_up",
    "options",
    "rows_with",
    "write_between",
]

RESULTS = "<!-- results -->", "<!-- end of results -->"
"""Marks around the table of a page."""

PACKAGES = ("wbc-suite", "mujoco", "pin", "numba", "numpy", "daqp", "mink", "pin-pink")


def options(description: str | None, quick: str) -> argparse.ArgumentParser:
    """Return the options that every script takes.

    Args:
        description: The script's docstring.
        quick: What `--quick` does; it takes under 50 s.
    """
    parser = argparse.ArgumentParser(description=(description or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help=f"{quick}, under 50 s")
    parser.add_argument("--json", type=Path, help="write rows and ratios here")
    return parser


class Report:
    """What one script found.

    Attributes:
        rows: One dictionary per case and side.
        ratios: Ours over theirs, by a path such as `Lift/Panda/OSC_POSE/raw`.
        tables: Titles and columns of what was shown.
        versions: Of what was measured, peers' included.
    """

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self.ratios: dict[str, float] = {}
        self.tables: list[dict[str, Any]] = []
        self.versions = _own_versions()

    def add(self, case: str, side: str, times: Iterable[float], **more: Any) -> dict:
        """Add and return a row: median and 99th percentile of times, us."""
        found = np.asarray(list(times), dtype=np.float64)
        row = {
            "case": case,
            "side": side,
            "median_us": float(np.median(found)),
            "p99_us": float(np.percentile(found, 99)),
            "n": len(found),
            **more,
        }
        self.rows.append(row)
        return row

    def compare(self, name: str, ours: dict, theirs: dict) -> None:
        """Book the ratio of two rows' medians."""
        self.ratios[name] = ours["median_us"] / theirs["median_us"]

    def show(self, title: str, columns: Sequence[str]) -> None:
        """Print a table of the rows that have one of these columns.

        The JSON file names the table too, so that the page in docs/ shows the same.
        """
        self.tables.append({"title": title, "columns": list(columns)})
        table = Table(title=title, title_justify="left")
        for name in columns:
            words = name in ("case", "side")
            side = "left" if words else "right"
            table.add_column(heading(name), justify=side, no_wrap=words)
        for row in rows_with(self.rows, columns):
            table.add_row(*(cell(look_up(row, name)) for name in columns))
        Console(width=max(120, Console().width)).print(table)

    def show_ratios(self) -> None:
        """Print all ratios."""
        for name, value in self.ratios.items():
            print(f"  {name:48} {value:.3g}")

    def write(self, path: Path | None) -> None:
        """Write the JSON file, where one was asked for."""
        if path is None:
            return
        report = {
            "about": {
                "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
                "machine": machine(),
                "versions": self.versions,
            },
            "tables": self.tables,
            "rows": self.rows,
            "ratios": self.ratios,
        }
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def rows_with(rows: list[dict], columns: Sequence[str]) -> list[dict]:
    """Return the rows that have one of the columns, beside case and side."""
    wanted = [name for name in columns if name not in ("case", "side", "n")]
    return [
        row for row in rows if any(look_up(row, name) is not None for name in wanted)
    ]


def look_up(row: dict[str, Any], name: str) -> Any:
    """Return a row's value; `a.b` is the value b of its part a."""
    first, _, rest = name.partition(".")
    value = row.get(first)
    return look_up(value, rest) if rest and isinstance(value, dict) else value


def heading(name: str) -> str:
    """Return a column's name as words."""
    return name.rpartition(".")[2].replace("_", " ")


def cell(value: Any) -> str:
    """Return a value as text of a table; three digits are enough."""
    if value is None:
        return ""
    if not isinstance(value, float):
        return str(value)
    if abs(value) >= 1000:
        return f"{value:.0f}"
    return f"{value:.3g}" if abs(value) >= 1e-4 or not value else f"{value:.0e}"


def written_by(command: str) -> str:
    """Return a sentence for a page: which command wrote it, when, and where."""
    day = datetime.datetime.now(datetime.UTC).date().isoformat()
    return f"Written by `python benchmarks/{command}`, {day}, {machine()}."


def machine() -> str:
    """Return processor, system and Python in words."""
    name, info = platform.processor(), Path("/proc/cpuinfo")
    if info.exists():
        lines = [x.partition(":") for x in info.read_text("utf-8").splitlines()]
        names = [
            value.strip() for key, _, value in lines if key.startswith("model name")
        ]
        name = f"{len(names)} x {names[0]}" if names else name
    system = f"{platform.system()} {platform.machine()}"
    return f"{name}, {system}, Python {platform.python_version()}"


def _own_versions() -> dict[str, str]:
    found = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def write_between(page: Path, table: str, marks: tuple[str, str] = RESULTS) -> None:
    """Write a table between two marks of a page of the documentation."""
    text, (begin, end) = page.read_text(encoding="utf-8"), marks
    before, after = text.split(begin)[0], text.split(end)[1]
    page.write_text(f"{before}{begin}\n\n{table}\n\n{end}{after}", "utf-8")
