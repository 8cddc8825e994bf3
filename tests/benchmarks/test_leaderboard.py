"""The leaderboard of controllers measures motions, and its page shows them all."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

ROOT = Path(__file__).parents[2]

from leaderboard import PARTS, Trial, moved, offset, reached  # noqa: E402
from write_leaderboard import left_out, page, table  # noqa: E402


def test_offsets_are_those_that_were_moved():
    start = pin.SE3.Random()
    goal = np.array([0.1, -0.2, 0.3, 0.2, 0.1, -0.4])
    np.testing.assert_allclose(offset(start, moved(start, goal)), goal, atol=1e-12)


@pytest.mark.slow
def test_joint_angles_reach_the_goal():
    trial = Trial("Panda", "JOINT_POSITION")
    trial.stand.reset()
    stand, start = trial.stand, trial.stand.pose(trial.frame)
    goal = moved(start, np.array([0.05, 0.0, 0.02, 0.1, 0.2, 0.0]))
    joints = [stand.state.prefix + j.name for j in stand.robot.joints[:7]]
    for joint, angle in zip(
        joints, reached(stand, joints, trial.site, goal), strict=True
    ):
        stand.data.joint(joint).qpos[0] = angle
    np.testing.assert_allclose(
        offset(goal, stand.pose(trial.frame)), np.zeros(6), atol=1e-5
    )


@pytest.mark.slow
@pytest.mark.parametrize("controller", PARTS)
def test_every_part_controller_brings_the_hand_to_its_goal(controller):
    trial = Trial("Panda", controller)
    goal = np.array([0.0, 0.0, 0.03, 0.0, 0.0, 0.0])
    found = trial.follow(np.tile(goal, (30, 1)))
    assert np.linalg.norm(found[-1, :3] - goal[:3]) < 2e-3
    figures = trial.figures()
    assert figures["energy_J"] > 1.0
    assert figures["past_range_mrad"] < 1.0
    assert figures["tick_p99_us"] >= figures["tick_us"] > 0.0


@pytest.mark.slow
def test_what_does_not_fit_is_left_out_with_its_reason(tmp_path):
    path = tmp_path / "out.json"
    command = [sys.executable, str(ROOT / "benchmarks/leaderboard.py")]
    command += ["--robots", "UR5e", "--controllers", "OSC_POSE", "HYBRID_MOBILE_BASE"]
    subprocess.run(
        [*command, "--json", path], check=True, capture_output=True, cwd=ROOT
    )
    report = json.loads(path.read_text())
    fits, not_fits = report["rows"]
    assert fits["settling_s"] < 2.0
    assert "no base that drives" in not_fits["left_out"]
    assert "no base that drives" in page(report)


def test_the_page_ranks_by_the_circle():
    rows = [
        {"case": "A", "side": "SLOW", "median_mm": 9.0, "settling_s": None},
        {"case": "A", "side": "GOOD", "median_mm": 1.23456, "settling_s": 0.4},
        {"case": "A", "side": "NONE", "left_out": "It moves no hand."},
    ]
    lines = table(rows).splitlines()
    assert lines[2].startswith("| `GOOD` | 0.4 |")
    assert "1.23" in lines[2]
    assert lines[3].startswith("| `SLOW` |  |")
    assert "NONE" not in table(rows)
    assert "- `NONE`: It moves no hand." in left_out(rows)
