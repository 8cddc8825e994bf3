"""Loading every robot of the catalogue and exporting it to both engines: what it costs.

Each robot is loaded from its TOML files, built as `MjSpec` and as `pinocchio.Model`,
in a process that has read the files and computed the hulls before ("warm"); "first" is
the first time. Times are CPU times of the process, in microseconds; compiling MuJoCo's
specification is MuJoCo's own work and stands beside.

Usage: python benchmarks/load_robots.py [--quick] [--json FILE]
"""

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import wbc_suite
from wbc_suite.catalogue import Catalogue

BUDGET = 50_000.0
"""Load and both exports, us."""
HUMANOID_BUDGET = 150_000.0
"""The same for a humanoid with two hands."""
clock = time.process_time_ns


def times(repeats: int, run: Callable[[], object]) -> list[float]:
    """Return the CPU time of each of several runs, us."""
    found: list[float] = []
    for _ in range(repeats):
        start = clock()
        run()
        found.append((clock() - start) / 1e3)
    return found


def measure(name: str, repeats: int) -> dict[str, list[float]]:
    """Return the times of one robot by what was done."""

    def load_and_export() -> None:
        robot = wbc_suite.load_robot(name)
        robot.to_mjspec()
        robot.to_pinocchio()

    first = times(1, load_and_export)
    robot = wbc_suite.load_robot(name)
    return {
        "first": first,
        "load": times(repeats, lambda: wbc_suite.load_robot(name)),
        "mjspec": times(repeats, robot.to_mjspec),
        "pinocchio": times(repeats, robot.to_pinocchio),
        "all": times(repeats, load_and_export),
        "compile": times(repeats, robot.to_mjspec().compile),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="5 repeats, not 30")
    parser.add_argument("--json", type=Path, help="write rows and ratios here")
    arguments = parser.parse_args()
    rows, ratios = [], {}
    for stem in Catalogue().names("robots"):
        measured = measure(stem, 5 if arguments.quick else 30)
        name = wbc_suite.load_robot(stem).name
        if not rows:
            print(f"{'median ms':22}" + "".join(f"{side:>11}" for side in measured))
        medians = {side: float(np.median(t)) for side, t in measured.items()}
        for side, found in measured.items():
            p99 = float(np.percentile(found, 99))
            rows.append(
                {
                    "case": name,
                    "side": side,
                    "median_us": medians[side],
                    "p99_us": p99,
                    "n": len(found),
                }
            )
        budget = HUMANOID_BUDGET if name.startswith("GR1") else BUDGET
        ratios[f"{name}/budget"] = medians["all"] / budget
        print(f"{name:22}" + "".join(f"{m / 1e3:11.1f}" for m in medians.values()))
    if arguments.json:
        text = json.dumps({"rows": rows, "ratios": ratios}, indent=1)
        arguments.json.write_text(text + "\n")


if __name__ == "__main__":
    main()
