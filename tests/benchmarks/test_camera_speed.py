"""The benchmark of pictures reports every kind and size, without a peer too."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent


@pytest.mark.slow
def test_every_kind_and_size_is_reported(tmp_path):
    path = tmp_path / "out.json"
    subprocess.run(
        [
            sys.executable,
            str(ROOT / "benchmarks/cameras.py"),
            "--quick",
            "--json",
            path,
        ],
        check=True,
        capture_output=True,
        cwd=ROOT,
        env=os.environ | {"ROBOSUITE_PYTHON": "/nowhere"},
    )
    rows = json.loads(path.read_text())["rows"]
    assert {row["case"].removeprefix("Lift/Panda/") for row in rows} == {
        f"{kind}/{size}"
        for kind in ("image", "depth", "segmentation")
        for size in (84, 256)
    }
    assert all(row["frames_per_second"] > 0.0 for row in rows)
