"""Cost of recording: CPU time of a step, and memory of a session.

Lift with Panda and random actions, no cameras. Turns of 20 steps that record and turns
that do not follow each other; then the same episode is run again with turns exchanged,
so that each is timed both ways, from the same state with the same actions. All that a
turn takes counts, what the recorder's work costs the environment's caches included. A
ratio is of two times of one turn, and a busy machine slows both. Times are CPU times of
the thread; there is a ratio of the process's too, which would show threads.

The session is one episode of ten minutes at 100 Hz: memory that the process holds more
than before at the episode's end, once the episode is kept, and once the file is closed;
and the most that it held meanwhile.

Usage: python benchmarks/recording.py [--quick] [--json FILE]
"""

import gc
import tempfile
import time
from pathlib import Path

import numpy as np
from harness.memory import forget_peak, peak, resident
from harness.report import Report, options

import wbc_suite
from wbc_suite.wrappers import DataCollection

TURN, TURNS = 20, 20  # steps, and turns of an episode
SESSION = 60_000  # steps: ten minutes at 100 Hz
MEMORY = "running_mb", "kept_mb", "closed_mb", "peak_mb"
CLOCKS = {"thread": time.thread_time, "process": time.process_time}


def episode(recorded, actions, *, first):
    """Return CPU times of a step in each turn, s, shape (TURNS, 2).

    Args:
        recorded: The environment that records.
        actions: Of the whole episode.
        first: Whether even turns record; odd ones do if not.
    """
    recorded.reset(seed=0)
    recorded.recorder.begin()
    times = []
    for k, some in enumerate(actions.reshape(TURNS, TURN, -1)):
        step = recorded.step if (k % 2 == 0) == first else recorded.env.step
        begun = [clock() for clock in CLOCKS.values()]
        for action in some:
            step(action)
        times.append([clock() for clock in CLOCKS.values()])
        times[-1] = [t - b for t, b in zip(times[-1], begun, strict=True)]
    recorded.recorder.discard()
    return np.array(times) / TURN


def compare(report, folder, *, episodes):
    """Time the same turns with and without recording."""
    env = wbc_suite.make("Lift", robots="Panda", horizon=10**7)
    recorded = DataCollection(env, folder / "compare.hdf5", automatic=False)
    rng, found = np.random.default_rng(0), []
    even = np.arange(TURNS) % 2 == 0
    for _ in range(episodes + 1):  # the first one warms up
        actions = rng.uniform(-0.3, 0.3, (TURN * TURNS, env.hold_action.size))
        one, other = (episode(recorded, actions, first=k) for k in (True, False))
        one[~even], other[~even] = other[~even], one[~even]
        found.append((one, other))
    recorded.close()
    with_it, without = np.concatenate(found[1:], axis=1)
    report.add("Lift/Panda", "step", list(1e6 * without[:, 0]))
    report.add("Lift/Panda", "recorded step", list(1e6 * with_it[:, 0]))
    for k, clock in enumerate(CLOCKS):
        ratios = with_it[:, k] / without[:, k]
        report.ratios[f"Lift/Panda/recording/{clock}"] = float(np.median(ratios))


def session(report, folder, *, count):
    """Record one long episode, and follow the memory."""
    env = wbc_suite.make("Lift", robots="Panda", horizon=10**7, control_freq=100.0)
    recorded = DataCollection(env, folder / "session.hdf5", automatic=False)
    recorded.reset(seed=0)
    recorded.recorder.begin()
    actions = np.random.default_rng(0).uniform(-0.3, 0.3, (64, env.hold_action.size))
    for action in actions:
        recorded.step(action)
    gc.collect()
    before = resident()
    forget_peak()
    for k in range(count):
        recorded.step(actions[k % 64])
    gc.collect()
    running = resident() - before
    recorded.recorder.keep()
    gc.collect()
    kept = resident() - before
    recorded.close()
    gc.collect()
    told = {"running_mb": running, "kept_mb": kept, "steps": count}
    told |= {"closed_mb": resident() - before, "peak_mb": peak() - before}
    report.rows.append({"case": "session", "side": "recorded", **told})


def main():
    parser = options(__doc__, "five episodes both ways, a session of 2,000 steps")
    chosen = parser.parse_args()
    report = Report()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        compare(report, folder, episodes=5 if chosen.quick else 40)
        session(report, folder, count=2000 if chosen.quick else SESSION)
    report.show("CPU time of a step", ("case", "side", "median_us", "p99_us"))
    report.show("Memory of a session", ("case", "steps", *MEMORY))
    report.show_ratios()
    report.write(chosen.json)


if __name__ == "__main__":
    main()
