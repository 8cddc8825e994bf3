"""Record in child processes, and kill each at a random moment; for test_crashes.

Prints, for each file, the seeds of the episodes that were said to be finished.
"""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
from random_episodes import HEADER, make_episode

from wbc_suite.recording import Store

PER_FILE = 8  # kills


def record(path, first, done):
    """Record seven episodes and close; say when each is finished."""
    with Store(path, HEADER) as store:
        for seed in range(first, first + 7):
            store.add(make_episode(seed, length=200))
            os.write(done, f"{seed} ".encode())
    os.write(done, b"closed ")


def record_and_kill(path, first, least, wait):
    """Return what was finished before a child was killed.

    Args:
        path: File that it records into.
        first: Seed of its first episode.
        least: How many episodes it may finish in peace, however long that takes.
        wait: How long after them it is killed, s.
    """
    said, done = os.pipe()
    child = os.fork()
    if child == 0:
        record(path, first, done)
        os._exit(0)
    os.close(done)
    with os.fdopen(said, "rb", buffering=0) as told:
        words = b""
        while words.count(b" ") < least and (more := told.read(64)):
            words += more
        time.sleep(wait)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        words += told.readall()
    return [word for word in words.decode().split() if word != "closed"]


folder, kills = Path(sys.argv[1]), int(sys.argv[2])
rng = np.random.default_rng(0)
begun = time.perf_counter()
record(folder / "whole.hdf5", 0, os.open(os.devnull, os.O_WRONLY))
whole = time.perf_counter() - begun
for number in range(0, kills, PER_FILE):
    finished = []
    for k in range(number, min(number + PER_FILE, kills)):
        least, wait = int(rng.integers(8)), rng.uniform(0.0, whole / 4.0)
        finished += record_and_kill(folder / f"{number}.hdf5", 10 * k, least, wait)
    print(f"{number}.hdf5", *finished)
