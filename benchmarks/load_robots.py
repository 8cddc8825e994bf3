"""Cost of loading every robot and exporting it to both engines.

Each robot is loaded from its TOML files, built as `MjSpec` and as `pinocchio.Model`,
in a process that has read the files and computed the hulls before ("warm"); "first" is
the first time. Times are CPU times of the process, in microseconds; compiling MuJoCo's
specification is MuJoCo's own work and stands beside.

Usage: python benchmarks/load_robots.py [--quick] [--json FILE]
"""

from harness.report import Report, options

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.timing import times

BUDGET = 50_000.0
"""Load and both exports, us."""
HUMANOID_BUDGET = 150_000.0
"""The same for a humanoid with two hands."""


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
    arguments = options(__doc__, "5 repeats, not 30").parse_args()
    report = Report()
    for stem in Catalogue().names("robots"):
        measured = measure(stem, 5 if arguments.quick else 30)
        name = wbc_suite.load_robot(stem).name
        rows = {side: report.add(name, side, found) for side, found in measured.items()}
        budget = HUMANOID_BUDGET if name.startswith("GR1") else BUDGET
        report.ratios[f"{name}/budget"] = rows["all"]["median_us"] / budget
    report.show("Loading and exporting robots, us", ("case", "side", "median_us", "n"))
    report.show_ratios()
    report.write(arguments.json)


if __name__ == "__main__":
    main()
