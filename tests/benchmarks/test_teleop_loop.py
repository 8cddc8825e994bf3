"""The benchmark of the teleoperation loop reports latency and jitter."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent.parent


@pytest.mark.slow
def test_inputs_and_periods_are_counted_with_viewers_and_a_recording(tmp_path):
    path, script = tmp_path / "out.json", ROOT / "benchmarks" / "teleop_loop.py"
    command = [sys.executable, str(script), "--seconds", "2", "--robots", "Panda"]
    subprocess.run([*command, "--json", path], check=True, cwd=ROOT)
    (row,) = json.loads(path.read_text())["rows"]
    assert row["inputs"] > 20
    assert 0.0 < row["latency_median_ms"] <= row["latency_p99_ms"]
    assert 0.0 <= row["jitter_median_ms"] <= row["jitter_p99_ms"]


def test_periods_count_as_quiet_in_seconds_without_stolen_time(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    from teleop_loop import quiet_figures

    begun = np.arange(0.0, 3.5, 0.01)
    begun[250:] += 0.005  # late once, in the third second
    stolen = np.array([[0.5, 7.0], [1.5, 7.0], [2.495, 7.0], [3.4, 9.0]])
    found = quiet_figures(begun, stolen)
    assert found["quiet_seconds"] == 1
    assert found["quiet_p99_ms"] == pytest.approx(0.0, abs=1e-9)
    stolen[-1, 1] = 7.0
    assert quiet_figures(begun, stolen)["quiet_seconds"] == 2
    stolen[:, 1] = np.arange(4.0)
    assert quiet_figures(begun, stolen) == {"quiet_seconds": 0}
