"""Memory of long episodes: they wait on disk, and are put into files piece by piece."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

MOST = 30.0
"""MB. The file has 67; found were 15, and 176 when episodes were put together whole."""

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"

RECORD = """
import sys
from pathlib import Path

from harness.memory import forget_peak, peak, resident

import wbc_suite
from wbc_suite.wrappers import DataCollection

env = wbc_suite.make("Lift", robots="Panda", horizon=10**7)
path = Path(sys.argv[1])
recorded = DataCollection(env, path, automatic=False)
recorded.reset(seed=0)
recorded.recorder.begin()
action = env.hold_action
for _ in range(10):
    seen, reward, _, _, info = recorded.step(action)
before = resident()
forget_peak()
for _ in range(60_000):
    recorded.recorder.add(action, seen, reward, done=False, info=info, step_time=0.0)
recorded.recorder.keep()
recorded.close()
print(peak() - before, path.stat().st_size / 1e6)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="Linux tells a process's memory.")
def test_ten_minutes_at_100_hz_are_recorded_and_closed_in_little_memory(tmp_path):
    command = [sys.executable, "-c", RECORD, str(tmp_path / "a.hdf5")]
    paths = os.pathsep.join([str(BENCHMARKS), os.environ.get("PYTHONPATH", "")])
    told = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PYTHONPATH": paths},
    ).stdout
    grown, file = map(float, told.split())
    assert file > 1.5 * MOST
    assert grown < MOST
