"""mujoco_warp's and MJX's side of tests: models on the CPU, beside MuJoCo.

Runs in `.venv-accelerators`, which has no wbc_suite.
Usage: accelerators_side.py warp|mjx FOUND.json STEPS FOLDER

The folder has `NAME.mjb`, and `NAME.npz` with the state and the controls. FOUND gets
for each name the greatest difference of positions in as many steps, or why the engine
refuses the model. With 0 steps nothing is compiled.
"""

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

os.environ["JAX_PLATFORMS"] = "cpu"
Step = Callable[[], np.ndarray]  # makes a step, and returns the positions


def in_warp(model: mujoco.MjModel, data: mujoco.MjData) -> Step:
    """Return the step of mujoco_warp from a state."""
    import mujoco_warp

    there, states = mujoco_warp.put_model(model), mujoco_warp.put_data(model, data)

    def step() -> np.ndarray:
        mujoco_warp.step(there, states)
        return states.qpos.numpy()[0]

    return step


def in_mjx(model: mujoco.MjModel, data: mujoco.MjData) -> Step:
    """Return the step of MJX from a state."""
    import jax
    from mujoco import mjx

    there, states = mjx.put_model(model), [mjx.put_data(model, data)]
    compiled = jax.jit(mjx.step)

    def step() -> np.ndarray:
        states[0] = compiled(there, states[0])
        return np.asarray(states[0].qpos)

    return step


def compare(path: Path, engine: Callable[..., Step], steps: int) -> float | str:
    """Return the greatest difference of positions in some steps, or a refusal."""
    model = mujoco.MjModel.from_binary_path(str(path))
    data, start = mujoco.MjData(model), np.load(path.with_suffix(".npz"))
    for name in start:
        getattr(data, name)[:] = start[name]
    mujoco.mj_forward(model, data)
    try:
        step = engine(model, data)
    except (NotImplementedError, ValueError) as error:
        return str(error)
    worst = 0.0
    for _ in range(steps):
        mujoco.mj_step(model, data)
        worst = max(worst, float(np.abs(step() - data.qpos).max()))
    return worst


if __name__ == "__main__":
    name, found, steps, folder = sys.argv[1:]
    engine = {"warp": in_warp, "mjx": in_mjx}[name]
    paths = sorted(Path(folder).glob("*.mjb"))
    away = {path.stem: compare(path, engine, int(steps)) for path in paths}
    Path(found).write_text(json.dumps(away))
