"""Cost of one environment step, compared with raw physics and with robosuite.

Lift at 20 Hz over 500 Hz: 25 physics steps an action, observations without cameras,
random actions (parts: +-0.1 of their range; whole-body: +-5 mm and rad around the poses
that hold). Each side is also timed against its own raw physics: `mj_step` of its own
compiled model from the states its steps began in, controls held. Both sides share one
processor and take turns of 8 steps, three to a block, which begins with a reset; a
ratio is the median of the turns' ratios, since a processor that changes its speed, as
on shared machines, does so for both sides. robosuite runs in its own
environment (.venv-robosuite, `make bench-peers`) and is left out where it is missing.
Times are CPU times of the process. Resets change no structure; robosuite's "hard" one,
its default, compiles anew.

Usage: python benchmarks/env_step.py [--quick] [--json FILE] [--blocks N] [--cases TEXT]
"""

import os
import sys
from dataclasses import dataclass

from harness.report import Report, options
from harness.robosuite import Robosuite
from harness.stand import arms_config

from wbc_suite.timing import Block, time_block, times

import numpy as np  # isort: skip  (after harness: it sets the number of BLAS threads)

import wbc_suite

STEPS, TURNS = 24, 3  # of one block; a turn is short beside changes of the clock
PART_SIZE, WHOLE_BODY_SIZE = 0.1, 0.005
COLUMNS = ("case", "side", "median_us", "p99_us", "raw_us", "over_raw", "n")


@dataclass(frozen=True, kw_only=True)
class Case:
    """A robot and the controller of its arms."""

    robot: str
    controller: str

    @property
    def name(self) -> str:
        return f"Lift/{self.robot}/{self.controller}"

    @property
    def size(self) -> float:
        whole = self.controller == "WHOLE_BODY_IK"
        return WHOLE_BODY_SIZE if whole else PART_SIZE


CASES = (
    Case(robot="Panda", controller="OSC_POSE"),
    Case(robot="Panda", controller="JOINT_POSITION"),
    Case(robot="Panda", controller="IK_POSE"),
    Case(robot="GR1", controller="WHOLE_BODY_IK"),
    Case(robot="GR1ArmsOnly", controller="WHOLE_BODY_IK"),
)


class Ours:
    """This project's environment."""

    def __init__(self, case: Case) -> None:
        self.env = wbc_suite.make(
            "Lift",
            robots=case.robot,
            controller_configs=controller_config(case),
            control_freq=20,
            horizon=10**9,
        ).unwrapped
        self.size, self.rng = case.size, np.random.default_rng(0)
        self.env.reset(seed=0)

    def begin(self) -> None:
        """Reset, and draw the actions of a block."""
        self.env.reset()
        hold = self.env.hold_action
        offsets = self.rng.uniform(-self.size, self.size, (STEPS, hold.size))
        self.actions = list(hold + offsets)

    def turn(self) -> Block:
        """Time the next steps of the block."""
        env, count = self.env, STEPS // TURNS
        actions, self.actions = self.actions[:count], self.actions[count:]
        return time_block(
            env.step,
            actions,
            model=env.simulation.model,
            data=env.simulation.data,
            substeps=round(1.0 / (env.config.control_freq * env.simulation.timestep)),
        )

    def resets(self, count: int) -> list[float]:
        return times(count, self.env.reset)


def controller_config(case: Case) -> str | dict:
    """Return the composite: whole-body, or one kind of part on every arm."""
    if case.controller == "WHOLE_BODY_IK":
        return case.controller
    return arms_config(case.robot, case.controller)


class Theirs:
    """robosuite's environment of the same case."""

    def __init__(self, case: Case, peer: Robosuite) -> None:
        self.peer, self.size = peer, case.size
        peer.ask("make", robot=case.robot, controller=case.controller)

    def begin(self) -> None:
        self.peer.ask("begin", count=STEPS, size=self.size)

    def turn(self) -> Block:
        return Block(**self.peer.ask("turn", count=STEPS // TURNS))

    def resets(self, count: int, *, hard: bool = False) -> list[float]:
        return self.peer.ask("reset", hard=hard, count=count)


def run_case(
    case: Case, peer: Robosuite | None, report: Report, *, blocks: int, resets: int
) -> None:
    """Time both sides in turns, block by block; then resets, where any are asked."""
    ours = Ours(case)
    theirs = None if peer is None else Theirs(case, peer)
    sides = {"ours": ours} if theirs is None else {"ours": ours, "robosuite": theirs}
    found: dict[str, list[Block]] = {name: [] for name in sides}
    for side in sides.values():
        side.begin()
        side.turn()  # compiles and warms up
    for _ in range(blocks):
        for side in sides.values():
            side.begin()
        for k in range(TURNS):
            for name in list(sides)[:: 1 if k % 2 else -1]:
                found[name].append(sides[name].turn())
    for name, turns in found.items():
        whole = Block()
        for block in turns:
            whole.extend(block)
        row = report.add(case.name, name, whole.step)
        row["raw_us"] = float(np.median(whole.raw))
        row["over_raw"] = ratio([(block.step, block.raw) for block in turns])
        key = "raw" if name == "ours" else f"{name}/raw"
        report.ratios[f"{case.name}/{key}"] = row["over_raw"]
    if theirs is not None:
        turns = zip(found["ours"], found["robosuite"], strict=True)
        pairs = [(own.step, other.step) for own, other in turns]
        report.ratios[f"{case.name}/robosuite"] = ratio(pairs)
    if resets:
        add_resets(f"Lift/{case.robot}/reset", ours, theirs, report, count=resets)


def ratio(turns: list[tuple[list[float], list[float]]]) -> float:
    """Return one side's times over the other's: medians of each turn, then of turns."""
    return float(np.median([np.median(one) / np.median(two) for one, two in turns]))


def add_resets(
    name: str, ours: Ours, theirs: Theirs | None, report: Report, *, count: int
) -> None:
    """Time resets; the peer's hard ones are slow, so they are few."""
    own = report.add(name, "ours", ours.resets(count))
    report.ratios[f"{name}/1ms"] = own["median_us"] / 1e3
    if theirs is None:
        return
    soft = report.add(name, "robosuite, soft", theirs.resets(count))
    few = max(1, count // 10)
    hard = report.add(name, "robosuite, hard", theirs.resets(few, hard=True))
    report.compare(f"{name}/robosuite", own, soft)
    report.compare(f"{name}/robosuite_hard", own, hard)


def stay_on_one_processor() -> None:
    """Let this process and its children share a processor, where the system can."""
    if sys.platform == "linux":
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def main() -> None:
    parser = options(__doc__, "3 blocks of 24 steps, without the last case")
    parser.add_argument("--blocks", type=int, default=20, help="of each side")
    parser.add_argument("--cases", default="", help="only those whose names hold this")
    arguments = parser.parse_args()
    stay_on_one_processor()
    blocks = 3 if arguments.quick else arguments.blocks
    cases = CASES[:-1] if arguments.quick else CASES
    cases = [case for case in cases if arguments.cases in case.name]
    report, peer = Report(), Robosuite.find()
    if peer is None:
        print("robosuite is left out: make bench-peers", file=sys.stderr)
    else:
        report.versions |= peer.versions
    robots = set()
    for case in cases:
        resets = 0 if case.robot in robots else blocks
        run_case(case, peer, report, blocks=blocks, resets=resets)
        robots.add(case.robot)
    if peer is not None:
        peer.close()
    report.show("One environment step, us of CPU time", COLUMNS)
    report.show_ratios()
    report.write(arguments.json)


if __name__ == "__main__":
    main()
