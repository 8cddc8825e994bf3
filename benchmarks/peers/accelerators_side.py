"""mujoco_warp's side of tests: models on the CPU, beside MuJoCo.

Runs in `.venv-accelerators`, which has no wbc_suite.
Usage: accelerators_side.py FOUND.json STEPS MODEL.mjb ...; only the first is stepped.
"""

import json
import sys
from pathlib import Path

import mujoco
import mujoco_warp
import numpy as np


def compare(model: mujoco.MjModel, steps: int) -> float:
    """Return the greatest difference of positions in some steps from the start."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    there, states = mujoco_warp.put_model(model), mujoco_warp.put_data(model, data)
    worst = 0.0
    for _ in range(steps):
        mujoco.mj_step(model, data)
        mujoco_warp.step(there, states)
        worst = max(worst, np.abs(states.qpos.numpy()[0] - data.qpos).max())
    return float(worst)


if __name__ == "__main__":
    found, steps, *paths = sys.argv[1:]
    models = {Path(p).stem: mujoco.MjModel.from_binary_path(p) for p in paths}
    taken = {}
    for name, model in models.items():
        try:
            mujoco_warp.put_model(model)
            taken[name] = None
        except (NotImplementedError, ValueError) as error:
            taken[name] = str(error)
    away = compare(next(iter(models.values())), int(steps))
    Path(found).write_text(json.dumps({"taken": taken, "away": away}))
