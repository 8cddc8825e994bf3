"""What recording costs: CPU time of a step with and without, and memory of a session.

Lift with Panda and random actions, no cameras. Blocks with and without a recorder
alternate within one run; times are CPU times of the thread. The session is one episode
of ten minutes at 20 Hz: memory that the process holds before, at its end, and after it
was put into the file.

Usage: python benchmarks/recording.py [--quick] [--json FILE]
"""

import gc
import tempfile
import time
from pathlib import Path

import numpy as np
from harness.report import Report, options

import wbc_suite
from wbc_suite.wrappers import DataCollection

STEPS = 200  # of a block
SESSION = 12_000  # steps: ten minutes at 20 Hz
clock = time.thread_time


def resident():
    """Return the memory that this process holds, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def steps(env, actions):
    """Return the CPU time of steps, s each."""
    begun = clock()
    for action in actions:
        env.step(action)
    return (clock() - begun) / len(actions)


def compare(report, folder, *, blocks):
    """Time the same environment with and without a recorder, by turns."""
    env = wbc_suite.make("Lift", robots="Panda", horizon=10**7)
    recorded = DataCollection(env, folder / "compare.hdf5", automatic=False)
    recorded.reset(seed=0)
    rng = np.random.default_rng(0)
    plain, with_file = [], []
    for _ in range(blocks + 1):  # the first one warms up
        actions = rng.uniform(-0.3, 0.3, (STEPS, env.unwrapped.hold_action.size))
        env.reset(seed=0)
        plain.append(steps(env, actions))
        recorded.reset(seed=0)
        recorded.recorder.begin()
        with_file.append(steps(recorded, actions))
        recorded.recorder.discard()
    recorded.close()
    case = "Lift/Panda"
    ours = report.add(case, "recorded", [1e6 * t for t in with_file[1:]])
    theirs = report.add(case, "plain", [1e6 * t for t in plain[1:]])
    report.compare(f"{case}/recording", ours, theirs)


def session(report, folder, *, count):
    """Record one long episode, and follow the memory."""
    env = wbc_suite.make("Lift", robots="Panda", horizon=10**7)
    recorded = DataCollection(env, folder / "session.hdf5", automatic=False)
    recorded.reset(seed=0)
    recorded.recorder.begin()
    actions = np.random.default_rng(0).uniform(
        -0.3, 0.3, (64, env.unwrapped.hold_action.size)
    )
    for action in actions:
        recorded.step(action)
    gc.collect()
    before = resident()
    for k in range(count):
        recorded.step(actions[k % 64])
    gc.collect()
    running = resident() - before
    recorded.recorder.keep()
    recorded.close()
    gc.collect()
    kept = resident() - before
    told = {"running_mb": running, "kept_mb": kept, "steps": count}
    report.rows.append({"case": "session", "side": "recorded", **told})


def main():
    parser = options(__doc__, "five pairs of blocks, a session of 2,000 steps")
    chosen = parser.parse_args()
    report = Report()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        compare(report, folder, blocks=5 if chosen.quick else 25)
        session(report, folder, count=2000 if chosen.quick else SESSION)
    report.show("CPU time of a step", ("case", "side", "median_us", "p99_us"))
    report.show("Memory of a session", ("case", "steps", "running_mb", "kept_mb"))
    report.show_ratios()
    report.write(chosen.json)


if __name__ == "__main__":
    main()
