"""Long runs: steps, resets, memory, seeds and placements.

Every benchmark with every robot that makes sense starts with eight seeds and takes 500
random actions, the nine with Panda 5,000 with each of three seeds; after each step
observations must be finite and inside their space, rewards inside [0, 1], and MuJoCo
without a warning. Episodes of the same seed are taken in this process, in spawned and
forked ones, by copies, with pictures and after 100 resets. All controllers refuse bad
actions and go on as without them, and bad numbers in the simulation are told at once.
Then resets, environments made and closed, many of them at once, and 200 placements.
Every trial runs in another process than this one, some of them in one of their own.
`--only` takes trials whose names hold a word, such as `speed/` or `GR1`. The JSON file
is written as results come, so that a run that is stopped is not lost.

Usage: python benchmarks/long_runs.py [--quick] [--json F] [--only WORD ...] [--jobs N]
"""

import itertools
import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass

from harness import bad_inputs, trials
from harness.report import Report, options
from harness.same_bits import differ
from harness.trials import Case, Found
from rich.progress import Progress

from wbc_suite.benchmark import BENCHMARKS

NINE = (
    *("Lift", "Stack", "PickPlace", "NutAssembly", "Door", "Wipe"),
    *("TwoArmLift", "TwoArmPegInHole", "TwoArmHandover"),
)
FEW = ("Panda", "GR1", "Tiago")
"""Robots of quick runs."""

LIMITS = {
    "over_raw": 1.4,
    "reset_ms": 5.0,
    "overlap_mm": 0.5,
    "speed_mm_s": 10.0,
    "grown_mb": 20.0,
    "files": 0.0,
    "threads": 0.0,
    "garbage": 0.0,
}
"""The most of each figure; made and closed environments may grow by `CYCLES_MB`."""
CYCLES_MB = 50.0


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One trial: which, of what, with which numbers."""

    kind: str
    run: Callable[..., Found]
    case: Case
    numbers: dict[str, int]
    own_process: bool = False

    @property
    def name(self) -> str:
        seed = self.numbers.get("seed")
        return f"{self.kind}/{self.case.name}" + ("" if seed is None else f"/{seed}")

    def __call__(self) -> Found:
        return trials.alone(self.run, self.case, self.numbers)


def all_trials(*, quick: bool) -> Iterator[Trial]:
    """Return the trials, the many short ones first."""
    names = ("Lift", "Wipe", "TwoArmHandover") if quick else sorted(BENCHMARKS)
    for name in names:
        for robots, way in trials.robots_of(name):
            if quick and (robots[0] not in FEW or way == "parallel"):
                continue
            case = Case(benchmark=name, robots=robots, way=way)
            seeds = {"seeds": 8}
            yield Trial(kind="start", run=trials.start, case=case, numbers=seeds)
            numbers = {"steps": 30 if quick else 500, "seed": 0}
            yield Trial(kind="robots", run=trials.act, case=case, numbers=numbers)
    for case in map(pandas, () if quick else NINE):
        for seed in range(3):
            numbers = {"steps": 5000, "seed": seed}
            yield Trial(kind="nine", run=trials.act, case=case, numbers=numbers)
    for case in map(pandas, names):
        yield from _of_one(case, quick=quick)
    yield from _of_bad_inputs(quick=quick)
    for case in map(pandas, ("Lift",) if quick else ("Lift", "NutAssembly")):
        yield from _of_memory(case, quick=quick)


def _of_one(case: Case, *, quick: bool) -> Iterator[Trial]:
    """Return what each benchmark is tried for with its own robots."""
    numbers = {"steps": 20 if quick else 500}
    yield Trial(kind="same bits", run=differ, case=case, numbers=numbers)
    numbers = {"seeds": 10 if quick else 200}
    yield Trial(kind="placement", run=trials.place, case=case, numbers=numbers)
    numbers = {"blocks": 2 if quick else 12}
    yield Trial(kind="speed", run=trials.over_raw, case=case, numbers=numbers)


def _of_bad_inputs(*, quick: bool) -> Iterator[Trial]:
    cases = bad_inputs.controlled("Lift")
    cases = cases[-1:] if quick else cases
    kinds = {
        "bad actions": (bad_inputs.refuse, "actions", 100 if quick else 10_000),
        "bad physics": (bad_inputs.inject, "count", 10 if quick else 200),
    }
    for (kind, (run, number, total)), case in itertools.product(kinds.items(), cases):
        numbers = {number: -(-total // len(cases))}
        yield Trial(kind=kind, run=run, case=case, numbers=numbers)


def _of_memory(case: Case, *, quick: bool) -> Iterator[Trial]:
    kinds = {
        "resets": (trials.reset_often, {"count": 100 if quick else 1000}),
        "cycles": (trials.make_and_close, {"cycles": 5 if quick else 200}),
        "many": (trials.keep_many, {"count": 5 if quick else 200}),
    }
    for kind, (run, numbers) in kinds.items():
        yield Trial(kind=kind, run=run, case=case, numbers=numbers, own_process=True)


def pandas(benchmark: str) -> Case:
    """Return a benchmark with its own choice of robots: Pandas."""
    return Case(benchmark=benchmark)


def run(trial: Trial) -> tuple[Trial, Found]:
    """Run a trial in a worker."""
    return trial, trial()


def results(wanted: list[Trial], jobs: int) -> Iterator[tuple[Trial, Found]]:
    """Run trials in other processes; those that measure memory in fresh ones."""
    context = multiprocessing.get_context("spawn")
    for own_process in (False, True):
        some = [t for t in wanted if t.own_process == own_process]
        tasks = 1 if own_process else None
        with ProcessPoolExecutor(jobs, context, max_tasks_per_child=tasks) as pool:
            for future in as_completed([pool.submit(run, t) for t in some]):
                yield future.result()


def book(report: Report, trial: Trial, found: Found) -> list[str]:
    """Add a row, and return what does not hold."""
    faults = dict(found.faults)
    row = report.add(trial.name, "ours", found.times or [0.0], **found.figures)
    row["faults"] = sum(faults.values())
    row["wrong"] = faults
    missed = [f"{trial.name}: {count} x {text}" for text, count in faults.items()]
    for name, value in found.figures.items():
        limit = CYCLES_MB if (trial.kind, name) == ("cycles", "grown_mb") else None
        limit = LIMITS.get(name) if limit is None else limit
        if limit is None or (name == "reset_ms" and trial.case.has_two_arms):
            continue
        if limit:
            report.ratios[f"{trial.name}/{name}/{limit:g}"] = value / limit
        if value > limit:
            missed.append(f"{trial.name}: {name} is {value:.3g}, not {limit:g}")
    return missed


def show(report: Report) -> None:
    """Print a table for each kind of trial."""
    for title, columns in (
        ("Random actions, us of CPU time a step", ("median_us", "p99_us", "faults")),
        ("A step over its own raw physics", ("over_raw", "raw_us", "reset_ms")),
        ("Placements, us of CPU time a reset", ("overlap_mm", "speed_mm_s")),
        ("Memory", ("grown_mb", "each_mb", "files", "threads", "garbage")),
    ):
        if any(name in row for row in report.rows for name in columns):
            report.show(title, ("case", *columns, "n"))


def main() -> None:
    parser = options(__doc__, "three benchmarks and robots, few of everything")
    parser.add_argument(
        "--only", nargs="+", default=[""], help="trials whose names hold one of these"
    )
    parser.add_argument("--jobs", type=int, default=1, help="trials at a time")
    arguments = parser.parse_args()
    wanted = [
        trial
        for trial in all_trials(quick=arguments.quick)
        if any(words in trial.name for words in arguments.only)
    ]
    report, missed = Report(), []
    with Progress() as progress:
        bar = progress.add_task("trials", total=len(wanted))
        for trial, found in results(wanted, arguments.jobs):
            wrong = book(report, trial, found)
            for line in wrong or [f"{trial.name}: holds"]:
                progress.console.print(line, soft_wrap=True, markup=False)
            missed += wrong
            progress.update(bar, advance=1, description=trial.name)
            report.write(arguments.json)
    show(report)
    print(f"{len(wanted)} trials, {len(missed)} things that do not hold")
    print(*missed, sep="\n")
    report.write(arguments.json)


if __name__ == "__main__":
    main()
