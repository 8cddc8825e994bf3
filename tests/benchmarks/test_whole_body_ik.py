"""The side-by-side benchmark poses one problem to all sides, and breaks no limit."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    path = tmp_path_factory.mktemp("bench") / "out.json"
    script = ROOT / "benchmarks" / "whole_body_ik.py"
    command = [sys.executable, str(script), "--ticks", "40", "--json", str(path)]
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT)
    return json.loads(path.read_text())


@pytest.mark.slow
def test_every_robot_has_a_row_for_us_and_for_mink(report):
    found = {(row["case"], row["side"]) for row in report["rows"]}
    for robot in ("GR1", "Tiago", "Panda"):
        assert {(robot, "ours"), (robot, "mink")} <= found
        assert f"{robot}/mink" in report["ratios"]
    for row in report["rows"]:
        assert row["n"] == 40
        assert 0.0 < row["median_us"] <= row["p99_us"]


@pytest.mark.slow
def test_ours_tracks_as_well_and_keeps_all_limits(report):
    by_side = {(row["case"], row["side"]): row for row in report["rows"]}
    for robot in ("GR1", "Tiago", "Panda"):
        ours, mink = by_side[robot, "ours"], by_side[robot, "mink"]
        assert ours["error_median_mm"] <= 1.05 * mink["error_median_mm"]
        assert ours["error_max_mm"] <= 1.05 * mink["error_max_mm"]
        assert ours["position_violation"] <= 1e-9
        assert ours["velocity_violation"] <= 1e-9
        assert ours["failed"] == 0
