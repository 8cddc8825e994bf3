"""Search for false verdicts from both sides, with four kinds of robots.

Each try puts the things of a benchmark somewhere: at their goals, tipped, leaned,
stacked, beside another, or between fingers that close; hands are somewhere near.
Robots are rigid, see `harness/rigid_world.py`; physics goes on for up to 0.4 s, and for
1 s and more where a robot stands on its feet. Then the benchmark's verdict is compared
with a judge that knows vertices, distances, and what happens next; see
`harness/geometric_judges.py`. States in which things overlap by more than 1 mm are
drawn anew; those that are too near to a bound are undecided.

Usage: python benchmarks/two_sided.py [BENCHMARK ...] [--robots R[,R] ...]
    [--tries 10000] [--seed 0] [--quick] [--json FILE]
       python benchmarks/two_sided.py --table FILE
"""

import json
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from harness.geometric_judges import JUDGES, judged
from harness.random_states import Doors, Pegs, Pots, States, Things, Wiping
from harness.report import Report, options, write_between
from harness.rigid_world import World
from harness.standing_states import (
    CarryStates,
    LocoLiftStates,
    ReachStates,
    StandStates,
    WalkToStates,
)

from wbc_suite.cli.options import progress

ONE = ("Panda", "PandaDexRH", "Baxter", "GR1")
TWO = ("Panda,Panda", "UR5e,Kinova3", "Baxter", "GR1")
FEET = ("Spot", "SpotWithArm", "GR1FreeBody", "G1FreeBody")
ROBOTS = {
    **{"Stand": FEET, "WalkTo": FEET, "Reach": FEET[1:], "LocoLift": FEET[1:]},
    "Carry": FEET[2:],
}
"""One arm with a jaw, with fingers; two arms; a humanoid. On feet: none, one, two."""
STATES: dict[str, type[States]] = {
    **{"Door": Doors, "TwoArmPegInHole": Pegs, "Wipe": Wiping},
    "TwoArmLift": Pots,
    **{"Stand": StandStates, "WalkTo": WalkToStates, "Reach": ReachStates},
    **{"LocoLift": LocoLiftStates, "Carry": CarryStates},
}
"""How states are drawn; those of all others are `Things`."""
ALL = (
    *("Lift", "Stack", "Door", "ToolHang", "Wipe"),
    *("NutAssembly", "NutAssemblySingle", "NutAssemblySquare", "NutAssemblyRound"),
    *("PickPlace", "PickPlaceSingle", "PickPlaceMilk", "PickPlaceBread"),
    *("PickPlaceCereal", "PickPlaceCan"),
    *("TwoArmLift", "TwoArmPegInHole", "TwoArmHandover", "TwoArmTransport"),
    *("Stand", "WalkTo", "Reach", "LocoLift", "Carry"),
)
PAGE = Path(__file__).parent.parent / "docs" / "evaluation.md"
MARKS = "<!-- verdicts -->", "<!-- end of verdicts -->"
SCENES = 50  # tries in each scene
SETTLING = 150  # physics steps after which what is held is asked for again


class Search:
    """Tries to find false verdicts of one benchmark with some robots."""

    def __init__(self, name: str, robots: str, seed: int) -> None:
        draws = STATES.get(name, Things)
        free = not issubclass(draws, Doors | Pegs | Things)
        self.world = World(name, robots.split(","), free=free)
        self.task: Any = self.world.task
        self.states = draws(self.world, np.random.default_rng(seed))
        kinds = [kind.__name__ for kind in type(self.task).__mro__]
        self.judge = next(JUDGES[kind] for kind in kinds if kind in JUDGES)
        self.counts: Counter[str] = Counter()
        self.done = self.overlaps = 0
        self.found: list[dict[str, Any]] = []

    def attempt(self) -> None:
        """Make one try, and note what came of it."""
        number = self.counts.total()
        if number % SCENES == 0:
            self.states.begin()
        while not self.states.draw():
            self.overlaps += 1
        verdict, truth, margins = self._verdicts()
        if truth and not verdict and isinstance(self.states, Things):
            self.world.run(SETTLING)  # grips may still slide to where they hold
            verdict, truth, margins = self._verdicts()
        kind = {None: "undecided", verdict: "right"}.get(truth, "false")
        self.counts[kind] += 1
        self.done += bool(truth and verdict)
        if kind == "false":
            side = "success" if verdict else "failure"
            one = {"try": number, "side": side, "margins": margins}
            self.found.append(one | {"qpos": self.world.data.qpos.tolist()})

    def _verdicts(self) -> tuple[bool, bool | None, list[float]]:
        """Return the benchmark's verdict, the judge's, and its margins."""
        verdict = self.task.success()
        return verdict, *judged(self.judge(self.world))


def table(rows: list[dict[str, Any]]) -> str:
    """Return the results as a table in Markdown."""
    lines = [
        "| benchmark | robots | tries | true | undecided | false successes "
        "| false failures |",
        "|---|---|---:|---:|---:|---:|---:|",
    ]
    keys = ("case", "side", "tries", "done", "undecided", "false_success")
    for row in rows:
        cells = [str(row.get(key, 0)) for key in (*keys, "false_failure")]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Search in the benchmarks that the arguments name."""
    parser = options(__doc__, "60 tries of three benchmarks")
    parser.add_argument("benchmarks", nargs="*")
    parser.add_argument("--robots", nargs="+")
    parser.add_argument("--tries", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--table", type=Path, help="write docs/evaluation.md from it")
    given = parser.parse_args()
    if given.table:
        rows = json.loads(given.table.read_text("utf-8"))["rows"]
        write_between(PAGE, table(rows), MARKS)
        return
    report, tries = Report(), 60 if given.quick else given.tries
    names = given.benchmarks or (ALL[:3] if given.quick else ALL)
    for name in names:
        two = TWO if name.startswith("TwoArm") else ONE
        kinds = given.robots or ROBOTS.get(name, two)
        for robots in kinds:
            search, begun = Search(name, robots, given.seed), time.process_time()
            count = -(-tries // len(kinds))
            with progress(f"{name} {robots}", count) as advance:
                for _ in range(count):
                    search.attempt()
                    advance(1)
            spent = time.process_time() - begun
            sides = Counter(one["side"] for one in search.found)
            row = {"case": name, "side": robots, "tries": count}
            row |= dict(search.counts) | {"done": search.done}
            row |= {f"false_{s}": sides[s] for s in ("success", "failure")}
            row |= {"ms": 1e3 * spent / count, "found": search.found[:20]}
            report.rows.append(row)
            for one in search.found[:3]:
                print(name, robots, one["side"], one["margins"], flush=True)
            print({k: v for k, v in row.items() if k != "found"}, flush=True)
        report.write(given.json)
    columns = ("case", "side", "tries", "done", "undecided")
    report.show("False verdicts", (*columns, "false_success", "false_failure", "ms"))
    report.write(given.json)


if __name__ == "__main__":
    main()
