"""Environments on two processors: threads of one process against processes.

Lift at 20 Hz over 500 Hz, two environments with random actions. Sides take turns, block
by block, in one run, each in processes of its own that wait while others work:

- 1 process: one environment alone
- 2 processes: one environment in each, at once
- 2 threads: two environments in one process, a thread each, free of each other
- vector: `gymnasium.make_vec`, 8 environments, 2 threads, in step

All take the same steps from the same seeds, and must end in equal states, bit for bit.
Reported: wall time per environment step (so half of a step's own time where two run
at once), and ratios of steps per second, where more is better: above 0.95 of what two
processes reach, a second process is not worth its memory. Memory is the resident set of
a process with one environment, and what each more adds.

These are wall times. When a virtual machine's host takes a processor away, the thread
that holds Python's lock keeps all threads waiting, but only one process of two: such
rounds say more about the host. So ratios are medians of those rounds in which nothing
was stolen from either side ("quiet"), and over all rounds as well ("/all").

Usage: python benchmarks/scaling.py [--quick] [--json FILE] [--rounds N] [--cases TEXT]
"""

import hashlib
import multiprocessing
import threading
import time
from collections.abc import Callable
from pathlib import Path

from env_step import Case, controller_config
from harness.memory import resident
from harness.processors import stolen_time
from harness.report import Report, options

import numpy as np  # isort: skip  (after harness: it sets the number of BLAS threads)

COLUMNS = ("case", "side", "median_us", "p99_us", "steps_per_s", "n", "quiet")
WEIGHTS = ("case", "side", "megabytes")
CASES = (
    Case(robot="Panda", controller="OSC_POSE"),
    Case(robot="Panda", controller="JOINT_POSITION"),
    Case(robot="Panda", controller="WHOLE_BODY_IK"),
    Case(robot="GR1", controller="WHOLE_BODY_IK"),
)
SECONDS = 0.2  # of one block, about; few have nothing stolen in longer ones
SIDES = {"1 process": 1, "2 processes": 2, "2 threads": 2, "vector": 8}
"""Sides, and how many environments each has."""
RATIOS = {
    "threads/processes": ("2 threads", "2 processes"),
    "vector/processes": ("vector", "2 processes"),
    "processes/one": ("2 processes", "1 process"),
}
"""Steps per second of the first over those of the second, round by round."""


def arguments_of(case: Case) -> dict:
    return {
        "robots": case.robot,
        "controller_configs": controller_config(case),
        "horizon": 10**9,
    }


def actions_of(case: Case, env, count: int, seed: int) -> np.ndarray:
    """Return the actions of the environment that is reset with this seed."""
    hold = env.hold_action
    rng = np.random.default_rng(seed)
    return hold + rng.uniform(-case.size, case.size, (count, hold.size))


def digest(env) -> str:
    """Return a hash of the state, equal where all bits are."""
    data = env.simulation.data
    state = np.concatenate([[data.time], data.qpos, data.qvel, data.act, data.ctrl])
    return hashlib.sha256(state.tobytes()).hexdigest()


class Free:
    """Environments that step as fast as they can, a thread each."""

    def __init__(self, case: Case, seeds: list[int]) -> None:
        import wbc_suite

        self.case, self.seeds = case, seeds
        made = [wbc_suite.make("Lift", **arguments_of(case)) for _ in seeds]
        self.envs = [env.unwrapped for env in made]

    def block(self, count: int) -> tuple[float, list[str]]:
        """Reset and step; return how long the steps took, s, and the last states."""
        plans = []
        for env, seed in zip(self.envs, self.seeds, strict=True):
            env.reset(seed=seed)
            plans.append((env, actions_of(self.case, env, count, seed)))
        start = time.perf_counter()
        together([lambda plan=plan: step_all(*plan) for plan in plans])
        return time.perf_counter() - start, [digest(env) for env in self.envs]


class InStep:
    """A vector of environments on two threads."""

    def __init__(self, case: Case, seeds: list[int]) -> None:
        import gymnasium

        import wbc_suite  # noqa: F401 - registers the environments

        self.case, self.seeds = case, seeds
        self.envs = gymnasium.make_vec(
            "wbc_suite/Lift-v1",
            num_envs=len(seeds),
            vectorization_mode="vector_entry_point",
            threads=2,
            **arguments_of(case),
        )

    def block(self, count: int) -> tuple[float, list[str]]:
        self.envs.reset(seed=self.seeds)
        single = self.envs.unwrapped.envs
        plans = [
            actions_of(self.case, env, count, seed)
            for env, seed in zip(single, self.seeds, strict=True)
        ]
        batches = np.stack(plans, axis=1)
        start = time.perf_counter()
        for batch in batches:
            self.envs.step(batch)
        return time.perf_counter() - start, [digest(env) for env in single]


def step_all(env, actions) -> None:
    for action in actions:
        env.step(action)


def together(jobs: list[Callable[[], None]]) -> None:
    """Run the first job in this thread and each other one in one of its own."""
    threads = [threading.Thread(target=job) for job in jobs[1:]]
    for thread in threads:
        thread.start()
    jobs[0]()
    for thread in threads:
        thread.join()


def serve(pipe, case: Case, kind: type, seeds: list[int]) -> None:
    """Run blocks on demand, in a process of its own."""
    side = kind(case, seeds)
    pipe.send(None)
    while (count := pipe.recv()) is not None:
        pipe.send(side.block(count))


class Worker:
    """A process that runs blocks of one side, or of half a side."""

    def __init__(self, case: Case, kind: type, seeds: list[int]) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, other = context.Pipe()
        self.process = context.Process(target=serve, args=(other, case, kind, seeds))
        self.process.start()
        other.close()
        self.pipe.recv()

    def close(self) -> None:
        self.pipe.send(None)
        self.process.join()


def run_block(workers: list[Worker], count: int) -> tuple[float, list[str]]:
    """Let workers run at once; return s of the slowest and all last states."""
    for worker in workers:
        worker.pipe.send(count)
    answers = [worker.pipe.recv() for worker in workers]
    return max(spent for spent, _ in answers), [d for _, ds in answers for d in ds]


def run_case(case: Case, report: Report, rounds: int) -> None:
    """Time all sides in turns."""
    first = Worker(case, Free, [0])
    sides = {
        "1 process": [first],
        "2 processes": [first, Worker(case, Free, [1])],
        "2 threads": [Worker(case, Free, [0, 1])],
        "vector": [Worker(case, InStep, list(range(SIDES["vector"])))],
    }
    for workers in sides.values():
        run_block(workers, 5)  # compiles and warms up
    count = max(10, round(10 * SECONDS / run_block(sides["2 processes"], 10)[0]))
    found, stolen = {name: [] for name in sides}, {name: [] for name in sides}
    states = {}
    for k in range(rounds):
        for name in list(sides)[:: 1 if k % 2 else -1]:
            steps = max(1, count // 4) if name == "vector" else count
            before = stolen_time()
            spent, states[name] = run_block(sides[name], steps)
            stolen[name].append(stolen_time() - before)
            found[name].append(1e6 * spent / steps / SIDES[name])
    for worker in {worker for workers in sides.values() for worker in workers}:
        worker.close()
    check_equal(case, states)
    add_times(case, report, found, stolen)


def check_equal(case: Case, states: dict[str, list[str]]) -> None:
    """Refuse figures of sides that did not do the same."""
    alone = states["2 processes"]
    for name in ("1 process", "2 threads"):
        if states[name] != alone[: len(states[name])]:
            raise SystemExit(f"{case.name}: {name} ended in other states.")


def add_times(
    case: Case,
    report: Report,
    found: dict[str, list[float]],
    stolen: dict[str, list[float]],
) -> None:
    quiet = {name: np.array(times) == 0.0 for name, times in stolen.items()}
    for name, times in found.items():
        row = report.add(case.name, name, times, quiet=int(quiet[name].sum()))
        row["steps_per_s"] = 1e6 / row["median_us"]
    for key, (ours, theirs) in RATIOS.items():
        quotients = np.array(found[theirs]) / np.array(found[ours])
        calm = quotients[quiet[ours] & quiet[theirs]]
        if calm.size:
            report.ratios[f"{case.name}/{key}"] = float(np.median(calm))
        report.ratios[f"{case.name}/{key}/all"] = float(np.median(quotients))


def weigh(pipe, case: Case, count: int) -> None:
    """Send the resident set with one environment, and with `count` more."""
    import wbc_suite

    envs = []
    for more in (1, count):
        for _ in range(more):
            env = wbc_suite.make("Lift", **arguments_of(case))
            env.reset(seed=0)
            for _ in range(3):
                env.step(env.unwrapped.hold_action)
            envs.append(env)
        pipe.send(resident())


def add_memory(case: Case, report: Report, count: int = 8) -> None:
    """Add what environments weigh; Linux only."""
    if not Path("/proc/self/statm").exists():
        return
    context = multiprocessing.get_context("spawn")
    pipe, other = context.Pipe()
    process = context.Process(target=weigh, args=(other, case, count))
    process.start()
    one, all_of_them = pipe.recv(), pipe.recv()
    process.join()
    each = (all_of_them - one) / count
    report.rows.append({"case": case.name, "side": "the first", "megabytes": one})
    report.rows.append({"case": case.name, "side": "each more", "megabytes": each})


def main() -> None:
    parser = options(__doc__, "3 rounds of one case")
    parser.add_argument("--rounds", type=int, default=40, help="of each side")
    parser.add_argument("--cases", default="", help="only those whose names hold this")
    arguments = parser.parse_args()
    cases = [case for case in CASES if arguments.cases in case.name]
    report = Report()
    for case in cases[:1] if arguments.quick else cases:
        run_case(case, report, 3 if arguments.quick else arguments.rounds)
        add_memory(case, report)
    report.show("Environments side by side, wall time", COLUMNS)
    report.show("Memory of environments in one process", WEIGHTS)
    report.show_ratios()
    report.write(arguments.json)


if __name__ == "__main__":
    main()
