"""Cost of finding the nearest pairs of capsules on a humanoid.

GR1 with its own collision shapes as capsules; hands chase targets inside and beside the
body, so that rows are active. Times are CPU times of the thread, in microseconds.

Usage: python benchmarks/self_collision.py [--quick] [--json FILE]
"""

import time

from harness.report import Report, options

import numpy as np  # isort: skip  (after harness: it sets the number of threads)
import pinocchio as pin

import wbc_suite
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    FrameTask,
    PostureTask,
    SelfCollisionLimit,
    TaskStack,
)

DT = 5e-3  # s
NEAREST = 20
clock = time.thread_time_ns


def run(ticks: int) -> tuple[list[float], list[float], float, int]:
    """Return times of rows and of whole ticks (us), least distance (m), pairs."""
    robot = wbc_suite.load_robot("GR1", root="fixed")
    model = robot.to_pinocchio()
    q = pin.neutral(model)
    for joint, value in robot.keyframes["ready"].items():
        q[model.joints[model.getJointId(joint)].idx_q] = value
    configuration = Configuration(model, q)
    hands = [FrameTask("right_eef"), FrameTask("left_eef")]
    limit = SelfCollisionLimit.of_robot(robot, nearest=NEAREST)
    stack = TaskStack(configuration, [*hands, PostureTask(1e-2)], limits=[limit])
    rng, homes = np.random.default_rng(0), [hand.target for hand in hands]
    G, h = np.zeros((NEAREST, model.nv)), np.zeros(NEAREST)
    rows, total, least = [], [], np.inf
    for k in range(ticks):
        if k % 100 == 0:
            for hand, home in zip(hands, homes, strict=True):
                place = home.translation + rng.uniform(-0.5, 0.5, 3)
                place[:2] = rng.uniform([-0.3, -0.4], [0.4, 0.4])
                hand.set_target(pin.SE3(pin.exp3(rng.normal(size=3)), place))
        t0 = clock()
        limit.rows(configuration, DT, G, h)
        t1 = clock()
        configuration.update(q)
        solution = stack.solve(DT)
        q = configuration.integrate(solution.dq)
        t2 = clock()
        rows.append((t1 - t0) / 1e3)
        total.append((t2 - t1) / 1e3)
        least = min(least, float(limit.distances[0]))
    return rows, total, least, limit.pair_count


def main() -> None:
    arguments = options(__doc__, "1,000 ticks").parse_args()
    rows, total, least, pairs = run(1000 if arguments.quick else 12_000)
    report = Report()
    report.add("GR1", "rows", rows, pairs=pairs, nearest=NEAREST, least_m=least)
    report.add("GR1", "tick", total)
    columns = (
        "case",
        "side",
        "median_us",
        "p99_us",
        "n",
        "nearest",
        "pairs",
        "least_m",
    )
    report.show("Self-collision rows, us of CPU time", columns)
    report.write(arguments.json)


if __name__ == "__main__":
    main()
