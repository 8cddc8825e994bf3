"""The scaling benchmark has every side, each in the same states, and the memory."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
CASE = "Lift/Panda/WHOLE_BODY_IK"


@pytest.mark.sweep
@pytest.mark.slow
def test_threads_stand_beside_processes(tmp_path):
    script, path = ROOT / "benchmarks" / "scaling.py", tmp_path / "out.json"
    command = [sys.executable, str(script), "--rounds", "1", "--cases", CASE]
    command += ["--json", str(path)]
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT)
    report = json.loads(path.read_text())
    rows = {row["side"]: row for row in report["rows"] if "median_us" in row}
    assert set(rows) == {"1 process", "2 processes", "2 threads", "vector"}
    for row in rows.values():
        assert row["case"] == CASE
        assert row["quiet"] in (0, 1)
        assert row["steps_per_s"] == pytest.approx(1e6 / row["median_us"])
    steps = {side: row["steps_per_s"] for side, row in rows.items()}
    for ratio, (ours, theirs) in {
        "threads/processes": ("2 threads", "2 processes"),
        "vector/processes": ("vector", "2 processes"),
        "processes/one": ("2 processes", "1 process"),
    }.items():
        found = report["ratios"][f"{CASE}/{ratio}/all"]
        assert found == pytest.approx(steps[ours] / steps[theirs])  # of one round
    weights = {row["side"]: row["megabytes"] for row in report["rows"][4:]}
    assert 0.5 < weights["each more"] < weights["the first"]
