"""The benchmark of a physics step compares scenes that differ in drawn geoms alone."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent


@pytest.mark.slow
def test_lean_scenes_have_fewer_geoms(tmp_path):
    script, path = ROOT / "benchmarks" / "physics_step.py", tmp_path / "out.json"
    command = [sys.executable, str(script), "--quick", "--json", str(path)]
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT)
    report = json.loads(path.read_text())
    rows = {(row["case"], row["side"]): row for row in report["rows"]}
    robots = {case for case, _ in rows}
    assert {"Panda", "GR1", "Tiago"} <= robots
    for robot in robots:
        lean, plain = rows[robot, "lean"], rows[robot, "every shape"]
        assert lean["geoms"] < 0.5 * plain["geoms"]
        assert 0.0 < lean["median_us"] <= lean["p99_us"]
        assert report["ratios"][f"{robot}/every_shape"] > 0.0
