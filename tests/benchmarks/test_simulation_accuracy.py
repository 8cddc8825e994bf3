"""A sample of the accuracy benchmark: hands arrive, limits hold, failures are told."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent


@pytest.mark.sample(1)
@pytest.mark.slow
@pytest.mark.parametrize("robot", ["Panda", "GR1", "Tiago", "SpotWithArm"])
def test_sampled_targets_are_met_in_simulation(robot, tmp_path):
    path = tmp_path / "out.json"
    script = ROOT / "benchmarks" / "simulation_accuracy.py"
    command = [sys.executable, str(script), "--robots", robot, "--json", str(path)]
    command += ["--trials", "5", "--ball", "2"]
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT)
    (row,) = json.loads(path.read_text())["rows"]
    reachable, ball = row["reachable"], row["ball"]
    legs = robot == "SpotWithArm"
    assert reachable["median_mm"] < (1.0 if legs else 0.1)
    assert reachable["median_deg"] < (0.2 if legs else 0.05)
    assert reachable["worst_mm"] < (5.0 if legs else 2.0)
    assert ball["worst_limit_overshoot_rad"] < 1e-3
    assert ball["missed_in_silence"] == 0
    assert ball["back_over_1mm"] == 0
