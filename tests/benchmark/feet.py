"""Robots on their feet, put where a test wants them."""

import numpy as np

import wbc_suite


def make(name, robot, **more):
    """Return an environment under WHOLE_BODY_ID, reset with seed 0."""
    env = wbc_suite.make(
        name,
        robots=robot,
        controller_configs="WHOLE_BODY_ID",
        initialization_noise=None,
        **more,
    )
    env.reset(seed=0)
    return env


def stand_at(env, x, y, yaw=0.0):
    """Put the robot somewhere, at rest, and let its controller start from there."""
    env.benchmark.standing.place(x, y, yaw)
    env.simulation.data.qvel[:] = 0.0
    env.simulation.start()
    hold(env, 5)


def lie_at(env, x, y):
    """Put the robot on its side on the floor, without velocity."""
    standing, data = env.benchmark.standing, env.simulation.data
    standing.place(x, y, 0.0)
    root = env.simulation.model.joint("robot0_root").qposadr[0]
    data.qpos[root + 2] = 0.2
    data.qpos[root + 3 : root + 7] = np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0
    env.simulation.start()


def hold(env, steps, **parts):
    """Take one action for some steps; return the last step's results."""
    result = None
    for _ in range(steps):
        action = env.action_layout.pack(parts, base=env.hold_action)
        result = env.step(action)
    return result


def count(env, steps):
    """Let the benchmark look at the same state as after some steps, as time goes by."""
    for _ in range(steps):
        env.simulation.data.time += 1.0 / env.config.control_freq
        env.benchmark.after_step()
    return env.benchmark
