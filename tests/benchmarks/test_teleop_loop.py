"""The benchmark of the teleoperation loop reports latency and jitter."""

import json
import subprocess
import sys
from pathlib import Path

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
