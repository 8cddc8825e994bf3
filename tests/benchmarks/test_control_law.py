"""The benchmark of control laws has a row for kernel, readable form and physics."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent


@pytest.mark.slow
def test_each_law_stands_beside_plain_python_and_physics(tmp_path):
    path, script = tmp_path / "out.json", ROOT / "benchmarks" / "control_law.py"
    command = [sys.executable, str(script), "--robots", "Panda", "--blocks", "3"]
    command += ["--kinds", "OSC_POSE", "JOINT_POSITION", "--json", str(path)]
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT)
    report = json.loads(path.read_text())
    medians = {(r["case"], r["side"]): r["median_us"] for r in report["rows"]}
    for case in ("Panda/OSC_POSE", "Panda/JOINT_POSITION"):
        assert all(medians[case, side] > 0.0 for side in ("kernel", "plain", "physics"))
        ratio = 1.0 + medians[case, "kernel"] / medians[case, "physics"]
        assert report["ratios"][f"{case}/physics"] == pytest.approx(ratio)
