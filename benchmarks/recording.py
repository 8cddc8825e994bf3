"""What recording costs: CPU time of a step with and without, and memory of a session.

Lift with Panda and random actions, no cameras. In each step the time of the environment
is taken apart from the time around it, which is the recorder's; blocks that record and
blocks that do not take turns, and what the latter spend around a step is subtracted. So
the ratio is of times of the same steps, and a busy machine slows both. Times are CPU
times of the thread. The session is one episode of ten minutes at 20 Hz: memory that the
process holds before, at its end, and after it was put into the file.

Usage: python benchmarks/recording.py [--quick] [--json FILE]
"""

import gc
import tempfile
import time
from pathlib import Path

import numpy as np
from harness.memory import resident
from harness.report import Report, options

import wbc_suite
from wbc_suite.wrappers import DataCollection

STEPS = 200  # of a block
SESSION = 12_000  # steps: ten minutes at 20 Hz
clock = time.thread_time


class Inside:
    """Takes the CPU time inside of an environment's steps, s."""

    def __init__(self, env):
        self.spent, self.step = 0.0, env.step
        env.step = self.timed

    def timed(self, action):
        begun = clock()
        result = self.step(action)
        self.spent += clock() - begun
        return result


def block(env, inside, actions):
    """Return the CPU time of a step inside of the environment and around it, s."""
    inside.spent, begun = 0.0, clock()
    for action in actions:
        env.step(action)
    around = clock() - begun - inside.spent
    return inside.spent / len(actions), around / len(actions)


def compare(report, folder, *, blocks):
    """Time the same steps inside and around, with and without recording, by turns."""
    env = wbc_suite.make("Lift", robots="Panda", horizon=10**7)
    recorded = DataCollection(env, folder / "compare.hdf5", automatic=False)
    inside, rng = Inside(env), np.random.default_rng(0)
    found = {False: [], True: []}
    for _ in range(blocks + 1):  # the first one warms up
        actions = rng.uniform(-0.3, 0.3, (STEPS, env.unwrapped.hold_action.size))
        for recording in (False, True):
            recorded.reset(seed=0)
            if recording:
                recorded.recorder.begin()
            found[recording].append(block(recorded, inside, actions))
            recorded.recorder.discard()
    recorded.close()
    (_, idle), (step, around) = (np.array(found[k][1:]).T for k in (False, True))
    recording = around - np.median(idle)
    report.add("Lift/Panda", "step", list(1e6 * step))
    report.add("Lift/Panda", "recording", list(1e6 * recording))
    report.ratios["Lift/Panda/recording"] = float(np.median(1.0 + recording / step))


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
