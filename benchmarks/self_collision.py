"""Self-collision rows on a humanoid: what finding the nearest pairs costs.

GR1 with its own collision shapes as capsules; hands chase targets inside and beside the
body, so that rows are active. Times are CPU times of the thread, in microseconds.

Usage: python benchmarks/self_collision.py [--quick] [--json FILE]
"""

import argparse
import json
import os
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pinocchio as pin

import wbc_suite
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    AccelerationLimit,
    FrameTask,
    PositionLimit,
    PostureTask,
    SelfCollisionLimit,
    TaskStack,
    VelocityLimit,
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
    limits = [PositionLimit(), VelocityLimit(), AccelerationLimit(), limit]
    stack = TaskStack(configuration, [*hands, PostureTask(1e-2)], limits=limits)
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
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="1,000 ticks")
    parser.add_argument("--json", type=Path, help="write rows and ratios here")
    arguments = parser.parse_args()
    ticks = 1000 if arguments.quick else 12_000
    rows, total, least, pairs = run(ticks)
    report = []
    for side, times in (("rows", rows), ("tick", total)):
        median, p99 = float(np.median(times)), float(np.percentile(times, 99))
        report.append(
            {
                "case": "GR1",
                "side": side,
                "median_us": median,
                "p99_us": p99,
                "n": len(times),
            }
        )
        print(f"GR1 {side:5} median {median:7.1f} us   p99 {p99:7.1f} us")
    print(f"{NEAREST} nearest of {pairs} capsule pairs; least distance {least:.4f} m")
    if arguments.json:
        text = json.dumps({"rows": report, "ratios": {}}, indent=1)
        arguments.json.write_text(text + "\n")


if __name__ == "__main__":
    main()
