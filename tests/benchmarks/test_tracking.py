"""A hand in operational space settles, follows and sags as its stiffness says."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HURRIED = {"Baxter": 1}
"""Of six steps, how many take longer than half a second: joints at their top speed."""

ROOT = Path(__file__).parent.parent.parent


@pytest.mark.sample(1)
@pytest.mark.slow
@pytest.mark.parametrize("robot", ["Panda", "Sawyer", "UR5e", "Baxter", "Tiago"])
def test_hands_track(robot, tmp_path):
    path, script = tmp_path / "out.json", ROOT / "benchmarks" / "tracking.py"
    command = [
        sys.executable,
        str(script),
        "--robots",
        robot,
        "--json",
        str(path),
    ]
    subprocess.run(
        command,
        check=True,
        capture_output=True,
        cwd=ROOT,
        env=os.environ | {"ROBOSUITE_PYTHON": "/nowhere"},
    )
    step, circle, payload = json.loads(path.read_text())["rows"]
    late = [h for s, h in zip(step["settled_s"], step["haste"], strict=True) if s > 0.5]
    assert len(step["settled_s"]) == 6
    assert len(late) <= HURRIED.get(robot, 0)
    assert all(haste > 0.99 for haste in late)
    assert max(step["settled_s"]) < 0.7
    assert max(step["settled_s"]) - step["soonest_s"] < 0.3
    assert step["overshoot"] < 0.02
    assert step["error_mm"] < 0.5
    assert step["error_deg"] < 0.1
    assert circle["worst_mm"] < 5.0
    assert payload["sag_mm"] == pytest.approx(payload["predicted_mm"], rel=0.1)
    assert payload["observed_mm"] < 1.0
