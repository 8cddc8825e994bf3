"""The loading benchmark has a row for each robot and each step, and its budget."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from wbc_suite.catalogue import Catalogue

ROOT = Path(__file__).parent.parent.parent


@pytest.mark.sweep
@pytest.mark.slow
def test_every_robot_has_its_rows(tmp_path):
    script, path = ROOT / "benchmarks" / "load_robots.py", tmp_path / "out.json"
    command = [sys.executable, str(script), "--quick", "--json", str(path)]
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT)
    report = json.loads(path.read_text())
    sides = {"first", "load", "mjspec", "pinocchio", "all", "compile"}
    robots = {row["case"] for row in report["rows"]}
    assert len(robots) == len(Catalogue().names("robots"))
    for robot in robots:
        own = {r["side"]: r for r in report["rows"] if r["case"] == robot}
        assert set(own) == sides
        assert all(0.0 < r["median_us"] <= r["p99_us"] for r in own.values())
        assert report["ratios"][f"{robot}/budget"] > 0.0
