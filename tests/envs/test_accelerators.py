"""mujoco_warp and MJX take exported models and step them as MuJoCo does, on the CPU."""

import json
import subprocess
from pathlib import Path

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.registration import BENCHMARKS

ROOT = Path(__file__).parents[2]
PYTHON = ROOT / ".venv-accelerators/bin/python"
SIDE = ROOT / "benchmarks/peers/accelerators_side.py"
STEPS = 100
CONTACT = 1e-2
"""Greatest difference of positions after `STEPS` steps in contact, m or rad: the
solvers of float32 and float64 stop at other places."""
EXACT = ("Door", "Lift", "TwoArmPegInHole", "Wipe")
"""Where nothing touches, or a cube rests."""

pytestmark = [pytest.mark.peer, pytest.mark.slow]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Both variants of every benchmark, with the state after the first action."""
    out = tmp_path_factory.mktemp("models")
    for name in BENCHMARKS:
        env = wbc_suite.make(name)
        env.reset(seed=0)
        env.step(np.zeros(env.action_space.shape))
        data = env.unwrapped.simulation.data
        for variant in ("exact", "accelerator"):
            path = out / variant / f"{name}.mjb"
            path.parent.mkdir(exist_ok=True)
            model = wbc_suite.export_model(env, variant=variant)
            mujoco.mj_saveModel(model, str(path), None)
            state = {key: getattr(data, key) for key in ("qpos", "qvel", "ctrl")}
            np.savez(path.with_suffix(".npz"), **state)
        env.close()
    return out


def away(tmp_path, engine, steps, models):
    if not PYTHON.exists():
        pytest.skip("not installed: make .venv-accelerators/.installed")
    found = tmp_path / "found.json"
    command = [PYTHON, SIDE, engine, found, str(steps), models]
    subprocess.run(command, check=True, timeout=1800)
    return json.loads(found.read_text())


def test_mujoco_warp_steps_every_benchmark_as_mujoco(folder, tmp_path):
    found = away(tmp_path, "warp", STEPS, folder / "exact")
    assert set(found) == set(BENCHMARKS)
    refused = {name: why for name, why in found.items() if isinstance(why, str)}
    assert refused == {}
    assert max(found.values()) < CONTACT, found
    assert max(found[name] for name in EXACT) < 1e-5  # float32 beside float64


def test_mjx_takes_the_accelerator_variant_of_every_benchmark(folder, tmp_path):
    found = away(tmp_path, "mjx", 0, folder / "accelerator")
    assert found == dict.fromkeys(BENCHMARKS, 0.0)
