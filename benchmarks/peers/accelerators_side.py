"""mujoco_warp's and MJX's side: models on the CPU, beside MuJoCo.

Runs in `.venv-accelerators`, which has no wbc_suite.
Usage: accelerators_side.py warp|mjx FOUND.json STEPS MODEL.mjb ...

Beside `NAME.mjb` lies `NAME.npz` with the state and the controls. FOUND gets for each
name why the engine refuses the model, or the greatest differences of positions, m or
rad: `apart` of the trees of bodies that have touched nothing so far, `all` of all. A
robot is one tree, and so is a cube. With 0 steps nothing is compiled.
"""

import json
import os
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

os.environ["JAX_PLATFORMS"] = "cpu"
# With the newer emitters compiling takes six times as long, or a step takes minutes.
os.environ["XLA_FLAGS"] = "--xla_cpu_use_fusion_emitters=false"
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
    """Return the step of MJX, its implementation in JAX, from a state."""
    import jax
    from mujoco import mjx

    there = mjx.put_model(model, impl="jax")
    states = [mjx.put_data(model, data, impl="jax")]
    compiled = jax.jit(mjx.step)

    def step() -> np.ndarray:
        states[0] = compiled(there, states[0])
        return np.asarray(states[0].qpos)

    return step


def trees_of_positions(model: mujoco.MjModel) -> np.ndarray:
    """Return for each element of `qpos` the tree of bodies that it moves."""
    widths = np.diff(np.append(model.jnt_qposadr, model.nq))
    trees = model.body_treeid[model.jnt_bodyid]
    return np.repeat(trees, widths.astype(int))


def compare(path: Path, engine: Callable[..., Step], steps: int) -> dict | str:
    """Return the greatest differences of positions in some steps, or a refusal."""
    model = mujoco.MjModel.from_binary_path(str(path))
    data, start = mujoco.MjData(model), np.load(path.with_suffix(".npz"))
    for name in start:
        getattr(data, name)[:] = start[name]
    mujoco.mj_forward(model, data)
    try:
        step = engine(model, data)
    except (NotImplementedError, ValueError) as error:
        return str(error)
    trees, touched = trees_of_positions(model), set[int]()
    found: dict[str, Any] = {"apart": 0.0, "all": 0.0}
    times = [time.process_time()]
    for _ in range(steps):
        mujoco.mj_step(model, data)
        bodies = model.geom_bodyid[data.contact.geom]
        touched.update(model.body_treeid[bodies].ravel().tolist())
        away = np.abs(step() - data.qpos)
        apart = away[~np.isin(trees, list(touched))]
        for key, values in (("apart", apart), ("all", away)):  # NaN stays NaN
            found[key] = float(np.maximum(found[key], values.max(initial=0.0)))
        times.append(time.process_time())
    if steps:
        kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        found |= {"first_step_s": times[1] - times[0], "peak_mb": kilobytes // 1000}
        found |= {"other_steps_s": times[-1] - times[1], "nv": int(model.nv)}
    return found


if __name__ == "__main__":
    name, found, steps, *models = sys.argv[1:]
    engine = {"warp": in_warp, "mjx": in_mjx}[name]
    away: dict[str, dict | str] = {}
    for path in map(Path, models):
        away[path.stem] = compare(path, engine, int(steps))
        Path(found).write_text(json.dumps(away))
