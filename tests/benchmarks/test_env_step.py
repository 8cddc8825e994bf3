"""The benchmark of environment steps reports both sides, each over its own physics."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
CASE = "Lift/GR1ArmsOnly/WHOLE_BODY_IK"


def run(tmp_path, python):
    script, path = ROOT / "benchmarks" / "env_step.py", tmp_path / "out.json"
    command = [sys.executable, str(script), "--blocks", "1", "--cases", CASE]
    subprocess.run(
        [*command, "--json", str(path)],
        check=True,
        capture_output=True,
        cwd=ROOT,
        env=os.environ | ({"ROBOSUITE_PYTHON": python} if python else {}),
    )
    return json.loads(path.read_text())


@pytest.mark.slow
def test_a_peer_that_is_missing_is_left_out(tmp_path):
    report = run(tmp_path, "/nowhere")
    assert {row["side"] for row in report["rows"]} == {"ours"}
    assert set(report["ratios"]) == {f"{CASE}/raw", "Lift/GR1ArmsOnly/reset/1ms"}
    step = report["rows"][0]
    assert step["n"] == 24
    assert 0.0 < step["raw_us"] < step["median_us"] <= step["p99_us"]
    assert step["over_raw"] == pytest.approx(step["median_us"] / step["raw_us"], rel=1)
    assert {"mujoco", "numpy"} <= report["about"]["versions"].keys()


@pytest.mark.sweep
@pytest.mark.peer
@pytest.mark.slow
def test_robosuite_stands_beside_us(tmp_path):
    if not (ROOT / ".venv-robosuite/bin/python").exists():
        pytest.skip("robosuite is not installed: make bench-peers")
    report = run(tmp_path, None)
    sides = {row["side"]: row for row in report["rows"] if row["case"] == CASE}
    assert set(sides) == {"ours", "robosuite"}
    assert sides["robosuite"]["n"] == sides["ours"]["n"]
    ratio = sides["ours"]["median_us"] / sides["robosuite"]["median_us"]
    assert report["ratios"][f"{CASE}/robosuite"] == pytest.approx(ratio, rel=1)
    assert report["about"]["versions"]["robosuite"] == "1.5.2"
