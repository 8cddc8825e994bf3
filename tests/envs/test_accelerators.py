"""mujoco_warp takes exported models and steps them as MuJoCo does, on the CPU."""

import json
import subprocess
from pathlib import Path

import mujoco
import pytest

import wbc_suite
from wbc_suite.registration import BENCHMARKS

ROOT = Path(__file__).parents[2]
PYTHON = ROOT / ".venv-accelerators/bin/python"
SIDE = ROOT / "benchmarks/peers/accelerators_side.py"


@pytest.mark.peer
@pytest.mark.slow
def test_mujoco_warp_takes_every_benchmark_and_steps_as_mujoco(tmp_path):
    if not PYTHON.exists():
        pytest.skip("mujoco_warp is not installed: make .venv-accelerators/.installed")
    paths = []
    for name in sorted(BENCHMARKS, key=lambda name: name != "Lift"):
        env = wbc_suite.make(name)
        env.reset(seed=0)
        paths.append(tmp_path / f"{name}.mjb")
        mujoco.mj_saveModel(wbc_suite.export_model(env), str(paths[-1]), None)
        env.close()
    found = tmp_path / "found.json"
    subprocess.run([PYTHON, SIDE, found, "5", *paths], check=True, timeout=900)
    report = json.loads(found.read_text())
    assert report["taken"] == dict.fromkeys(BENCHMARKS)
    assert report["away"] < 1e-5  # float32 beside float64
