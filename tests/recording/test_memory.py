"""Memory of long episodes: they wait on disk, and are put into files piece by piece."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

MOST = 10.0
"""MB that an episode takes beyond a shorter one, whose file is 28 MB smaller; found
were 2.5."""

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"

RECORD = """
import sys
from pathlib import Path

from harness.memory import forget_peak, peak

import wbc_suite
from wbc_suite.wrappers import DataCollection

env = wbc_suite.make("Lift", robots="Panda", horizon=10**7)


def record(path, rows):
    recorded = DataCollection(env, path, automatic=False)
    recorded.reset(seed=0)
    recorded.recorder.begin()
    seen, reward, _, _, info = recorded.step(env.hold_action)
    row = env.hold_action, seen, reward
    for _ in range(rows):
        recorded.recorder.add(*row, done=False, info=info, step_time=0.0)
    recorded.recorder.keep()
    recorded.recorder.close()
    return path.stat().st_size / 1e6


folder = Path(sys.argv[1])
forget_peak()
few = record(folder / "few.hdf5", 10_000)
before = peak()
many = record(folder / "many.hdf5", 40_000)
print(peak() - before, many - few)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="Linux tells a process's memory.")
def test_a_longer_episode_is_recorded_and_closed_in_no_more_memory(tmp_path):
    command = [sys.executable, "-c", RECORD, str(tmp_path)]
    paths = os.pathsep.join([str(BENCHMARKS), os.environ.get("PYTHONPATH", "")])
    told = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PYTHONPATH": paths},
    ).stdout
    grown, longer = map(float, told.split())
    assert longer > 2.5 * MOST
    assert grown < MOST
