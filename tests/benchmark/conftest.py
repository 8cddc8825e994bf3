"""What every benchmark must hold; see `test_every_benchmark.py`."""

import mujoco
import numpy as np


def penetration(env):
    """Return how deep things overlap with anything, m."""
    states = env.benchmark.states.values()
    own = {g for state in states for g in state.geoms}
    pairs, depth = env.simulation.data.contact.geom, env.simulation.data.contact.dist
    mine = [float(d) for (a, b), d in zip(pairs, depth, strict=True) if {a, b} & own]
    return -min(mine, default=0.0)


def speeds(env):
    """Return the speed of each free thing, m/s."""
    data = env.simulation.data
    return {
        name: float(np.linalg.norm(data.joint(f"{name}_joint").qvel[:3]))
        for name in env.benchmark.states
        if env.benchmark.states[name].is_free
    }


def hand_touches(monkeypatch, task, name):
    """Take what an object touches for a robot."""
    monkeypatch.setattr(task.scene, "robot_geoms", task.scene.touched_by(name))


def put(env, **poses):
    """Put things somewhere, (position, quat or None), and update the simulation."""
    for name, (position, quat) in poses.items():
        env.benchmark.states[name].move(position, quat or (1.0, 0.0, 0.0, 0.0))
    mujoco.mj_forward(env.simulation.model, env.simulation.data)
    return env.benchmark
