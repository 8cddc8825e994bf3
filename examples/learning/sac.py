"""Soft actor-critic on many environments at once, by Stable-Baselines3 or by sbx.

    .venv-learning/bin/python examples/learning/sac.py
    .venv-learning/bin/python examples/learning/sac.py 'benchmark="Door"' seed=1

Each environment runs in a process of its own. A stopped run goes on from its last
checkpoint and replay buffer. TensorBoard files and a curve are in the folder.
"""

import json
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from sac_checkpoints import Checkpoints, parameters, resume
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.noise import (
    OrnsteinUhlenbeckActionNoise,
    VectorizedActionNoise,
)
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv
from training import Settings, arguments, write_checkpoint

import wbc_suite
from wbc_suite.evaluation import episode_seeds, success_interval
from wbc_suite.wrappers import Flat


def make_env(settings: Settings) -> gymnasium.Env[Any, Any]:
    """Make one environment, with observations and actions as single vectors."""
    env = wbc_suite.make(
        settings.benchmark,
        robots=settings.robots,
        controller_configs=settings.controller,
        reward_shaping=True,
        horizon=settings.horizon,
    )
    return Monitor(Flat(env), info_keywords=("is_success",))


def algorithm(settings: Settings) -> Any:
    """Return the class SAC of the library."""
    if settings.library == "sbx":
        import sbx

        return sbx.SAC
    import stable_baselines3

    return stable_baselines3.SAC


class Curve(BaseCallback):
    """Appends the mean return and success of finished episodes to curve.jsonl."""

    def __init__(self, path: Path, every: int) -> None:
        super().__init__()
        self.path, self.every, self.last = path, every, 0
        self.begun = time.perf_counter()

    def _on_step(self) -> bool:
        buffer = self.model.ep_info_buffer
        if buffer and self.num_timesteps - self.last >= self.every:
            self.last = self.num_timesteps
            row = {
                "step": self.num_timesteps,
                "return": float(np.mean([e["r"] for e in buffer])),
                "success": float(np.mean([e["is_success"] for e in buffer])),
                "seconds": round(time.perf_counter() - self.begun, 1),
            }
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
        return True


def train(settings: Settings) -> tuple[Any, Path]:
    """Train until `steps`, from the last checkpoint on; return the model."""
    folder = Path(settings.folder)
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(settings, indent=1) + "\n"
    (folder / "settings.json").write_text(text, encoding="utf-8")
    envs: VecEnv = SubprocVecEnv([partial(make_env, settings)] * settings.envs)
    envs.seed(settings.seed)
    network: dict[str, Any] = {"net_arch": list(settings.layers)}
    if settings.library == "sbx":
        network["layer_norm"] = settings.layer_norm
    model = algorithm(settings)(
        "MlpPolicy",
        envs,
        seed=settings.seed,
        learning_rate=settings.learning_rate,
        buffer_size=settings.buffer,
        batch_size=settings.batch,
        gamma=settings.discount,
        learning_starts=settings.learning_starts,
        train_freq=1,
        gradient_steps=settings.gradient_steps,
        n_steps=settings.n_steps,
        action_noise=exploration_noise(settings, envs) if settings.noise else None,
        policy_kwargs=network,
        tensorboard_log=str(folder / "tensorboard"),
    )
    resume(model, folder)
    checkpoints = Checkpoints(folder, max(1, settings.save_every // settings.envs))
    curve = Curve(folder / "curve.jsonl", settings.log_every)
    missing = settings.steps - model.num_timesteps
    if missing > 0:
        model.learn(
            missing,
            callback=CallbackList([checkpoints, curve]),
            reset_num_timesteps=False,
        )
    write_checkpoint(folder / "last.pt", parameters(model))
    envs.close()
    return model, folder


def exploration_noise(settings: Settings, envs: VecEnv) -> VectorizedActionNoise:
    """Return noise for the actions of each environment.

    It is an Ornstein-Uhlenbeck process with the standard deviation `noise`, whose
    correlation falls to 1/e in `noise_steps`.
    """
    size, keep = envs.action_space.shape[0], np.exp(-1.0 / settings.noise_steps)
    sigma = np.full(size, settings.noise * np.sqrt(1.0 - keep**2))
    one = OrnsteinUhlenbeckActionNoise(np.zeros(size), sigma, theta=1.0 - keep, dt=1.0)
    return VectorizedActionNoise(one, envs.num_envs)


def evaluate(settings: Settings, act: Callable[[Any], Any]) -> list[tuple[float, bool]]:
    """Return the return and success of each evaluation episode."""
    env, found = make_env(settings), []
    for seed in episode_seeds(settings.benchmark, settings.evaluate, base=1):
        (observation, _), over, total, solved = env.reset(seed=seed), False, 0.0, False
        while not over:
            step = env.step(act(observation))
            observation, reward, terminated, truncated, info = step
            total, over = total + float(reward), terminated or truncated
            solved = solved or bool(info["is_success"])
        found.append((total, solved))
    return found


def draw(folder: Path) -> Path:
    """Draw return and success over environment steps; return the picture's file."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    path = folder / "curve.jsonl"
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    rows = [json.loads(line) for line in lines]
    figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.2))
    for each, name in zip(axes, ("return", "success"), strict=True):
        each.plot([row["step"] for row in rows], [row[name] for row in rows])
        each.set(xlabel="environment steps", ylabel=name)
        each.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(folder / "curves.png", dpi=90)
    return folder / "curves.png"


def main() -> None:
    """Run from the command line."""
    settings = arguments(__file__)
    model, folder = train(settings)
    found = evaluate(settings, lambda seen: model.predict(seen, deterministic=True)[0])
    returns, solved = zip(*found, strict=True)
    low, high = success_interval(sum(solved), len(solved))
    print(
        f"Return {np.mean(returns):.1f}, success {np.mean(solved):.1%} ({low:.1%} to "
        f"{high:.1%}) in {len(solved)} episodes. {draw(folder)}"
    )


if __name__ == "__main__":
    main()
