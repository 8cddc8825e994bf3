"""Exported models for other engines, in files, and the results of those engines.

The engines have an environment of their own: `make .venv-accelerators/.installed`.
"""

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import wbc_suite
from wbc_suite.envs.env import RobotEnv

__all__ = ["PYTHON", "VARIANTS", "step_in", "write_models"]

ROOT = Path(__file__).parents[2]
PYTHON = ROOT / ".venv-accelerators/bin/python"
SIDE = ROOT / "benchmarks/peers/accelerators_side.py"
VARIANTS = {"warp": "exact", "mjx": "accelerator"}
"""Of models, by engine."""


def write_models(env: RobotEnv, folder: Path, name: str) -> None:
    """Write both variants of a model, with the state after a first action of zeros."""
    env.reset(seed=0)
    env.step(np.zeros(env.action_layout.size))
    data = env.simulation.data
    for variant in ("exact", "accelerator"):
        path = folder / variant / f"{name}.mjb"
        path.parent.mkdir(exist_ok=True)
        model = wbc_suite.export_model(env, variant=variant)
        mujoco.mj_saveModel(model, str(path), None)
        state = {key: getattr(data, key) for key in ("qpos", "qvel", "ctrl")}
        np.savez(path.with_suffix(".npz"), **state)


def step_in(
    engine: str, folder: Path, names: Sequence[str], *, steps: int, timeout: float
) -> dict[str, Any]:
    """Return what the other side found of some models; see its docstring.

    Raises:
        subprocess.SubprocessError: If it fails, or takes longer.
    """
    found = folder / f"{engine}.json"
    models = [folder / VARIANTS[engine] / f"{name}.mjb" for name in names]
    command = [PYTHON, SIDE, engine, found, str(steps), *models]
    subprocess.run(command, check=True, timeout=timeout, stdout=subprocess.DEVNULL)
    return json.loads(found.read_text("utf-8"))
