"""The work of one item: its episodes, one after the other."""

import shutil
import time
from pathlib import Path
from typing import Any

import gymnasium

from wbc_suite.envs import RobotEnv, make
from wbc_suite.executors import Item
from wbc_suite.policies import make_policy
from wbc_suite.recording.dataset import parts_folder
from wbc_suite.wrappers import DataCollection

__all__ = ["roll_out"]


def roll_out(item: Item, folder: Path) -> dict[str, Any]:
    """Play the episodes of an item; what came of each is a line of the result.

    Success is what the benchmark says at any step of the episode (`succeeded`) and at
    its last (`success`). A physics error ends an episode as a failure.

    Args:
        item: See `plan`.
        folder: Of the ledger; recordings go into its `episodes`, a file per item.
    """
    told: Any = item.payload
    env = inner = make(
        told["benchmark"],
        robots=told["robots"],
        **({"controller_configs": told["controller"]} if told["controller"] else {}),
        **told["arguments"],
    )
    if told["record"]:
        env = DataCollection(inner, _fresh(folder / "episodes" / f"{item.name}.hdf5"))
    try:
        seeds = range(*told["seeds"])
        episodes = [_play(env, inner, seed, told["policy"]) for seed in seeds]
    finally:
        env.close()
    return {"episodes": episodes}


def _fresh(path: Path) -> Path:
    """Take away what a worker that died has left of an item's recording."""
    path.unlink(missing_ok=True)
    shutil.rmtree(parts_folder(path), ignore_errors=True)
    return path


def _play(
    env: gymnasium.Env[Any, Any], inner: RobotEnv, seed: int, name: str
) -> dict[str, Any]:
    """Play one episode to its end."""
    observation, info = env.reset(seed=seed)
    policy = make_policy(name, inner, seed)
    start, steps, total, succeeded, over = time.perf_counter(), 0, 0.0, False, False
    while not over:
        action = policy(observation)
        observation, reward, terminated, truncated, info = env.step(action)
        steps, total = steps + 1, total + float(reward)
        succeeded = succeeded or bool(info["success"])
        over = terminated or truncated
    return {
        "seed": seed,
        "success": bool(info["success"]),
        "succeeded": succeeded,
        "return": total,
        "steps": steps,
        "seconds": round(time.perf_counter() - start, 4),
        "physics_error": info.get("physics_error"),
    }
