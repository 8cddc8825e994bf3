"""Cost of each control law in a physics step.

Robots stand alone on a floor; one kind of part controller drives every arm, grippers
and the rest are held. "kernel" is the whole compiled control of a step, all laws of the
robot, between `mj_step1` and `mj_step2`; "plain" is the same function in plain Python;
"physics" is `mj_step1` and `mj_step2` without control. Blocks alternate; times are CPU
times of the thread, in microseconds a step. The ratio "physics" is (physics + kernel) /
physics.

Usage: python benchmarks/control_law.py [--quick] [--json FILE] [--robots NAME ...]
"""

import time
from collections.abc import Callable

from harness.report import Report, options
from harness.stand import Stand, arms_config

import mujoco  # isort: skip  (after harness: it sets the number of threads)
import numba

from wbc_suite.compiling import plain
from wbc_suite.control.ground.records import gather
from wbc_suite.control.run.data import LoopData, loop_data
from wbc_suite.control.run.kernel_table import LoopKernels, bind_kernels
from wbc_suite.control.run.motor_commands import write_commands

ROBOTS = ("Panda", "Sawyer", "UR5e", "Baxter", "Tiago", "GR1")
KINDS = ("OSC_POSE", "OSC_POSITION")
KINDS += ("JOINT_POSITION", "JOINT_VELOCITY", "JOINT_TORQUE")
STEPS = 200  # of one block of compiled code
PLAIN_STEPS = 10
COLUMNS = ("case", "kernel_us", "plain_us", "physics_us", "over_physics")
clock = time.thread_time_ns


@numba.njit(nogil=True)
def control_only(loop: LoopData, kernels: LoopKernels, steps: int) -> None:
    """Compute the control of one instant again and again."""
    for _ in range(steps):
        write_commands(loop, kernels)


class Law:
    """One robot under one kind of part controller, and what is timed of it."""

    def __init__(self, robot: str, kind: str) -> None:
        self.stand = Stand(robot, arms_config(robot, kind))
        self.stand.reset()
        stand = self.stand
        pieces = [(law.record, law.drives) for law in stand.controller.laws]
        self.data = loop_data(stand.model, stand.data, *gather(pieces))
        self.loop, self.kernels, self.owner = bind_kernels(self.data)
        mujoco.mj_step1(stand.model, stand.data)

    def plain(self, steps: int) -> None:
        """Compute the control of one instant again and again, in plain Python."""
        write = plain(write_commands)
        loop, kernels, _ = bind_kernels(self.data, compiled=False)
        for _ in range(steps):
            write(loop, kernels)

    def run(self, blocks: int) -> dict[str, list[float]]:
        """Return times of one step by side, us."""
        runs: dict[str, tuple[int, Callable[[int], None]]] = {
            "kernel": (STEPS, self._kernel),
            "plain": (PLAIN_STEPS, self.plain),
            "physics": (STEPS, self._physics),
        }
        found: dict[str, list[float]] = {side: [] for side in runs}
        for k in range(blocks + 1):
            for side, (steps, call) in runs.items():
                self.stand.start()
                mujoco.mj_step1(self.stand.model, self.stand.data)
                self._kernel(1)
                start = clock()
                call(steps)
                if k:  # the first compiles
                    found[side].append((clock() - start) / 1e3 / steps)
        return found

    def _kernel(self, steps: int) -> None:
        control_only(self.loop, self.kernels, steps)

    def _physics(self, steps: int) -> None:
        mujoco.mj_step(self.stand.model, self.stand.data, steps)


def run_case(robot: str, kind: str, report: Report, *, blocks: int) -> None:
    """Add rows and ratios of one robot and one kind."""
    name = f"{robot}/{kind}"
    found = Law(robot, kind).run(blocks)
    rows = {side: report.add(name, side, times) for side, times in found.items()}
    medians = {f"{side}_us": row["median_us"] for side, row in rows.items()}
    ratio = 1.0 + medians["kernel_us"] / medians["physics_us"]
    rows["kernel"] |= {**medians, "over_physics": ratio}
    report.ratios[f"{name}/physics"] = ratio
    report.compare(f"{name}/plain", rows["kernel"], rows["plain"])


def main() -> None:
    parser = options(__doc__, "Panda and Baxter, 20 blocks")
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS))
    parser.add_argument("--kinds", nargs="+", default=list(KINDS))
    parser.add_argument("--blocks", type=int, default=200)
    arguments = parser.parse_args()
    robots = ["Panda", "Baxter"] if arguments.quick else arguments.robots
    report = Report()
    for robot in robots:
        for kind in arguments.kinds:
            blocks = 20 if arguments.quick else arguments.blocks
            run_case(robot, kind, report, blocks=blocks)
    report.show("Control of one physics step, us of CPU time", COLUMNS)
    report.show_ratios()
    report.write(arguments.json)


if __name__ == "__main__":
    main()
