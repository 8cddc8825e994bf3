"""What the learning scripts share: settings, demonstrations, checkpoints and curves."""

import copy
import json
import os
import tomllib
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import torch
from torch import Tensor, nn
from torch.utils.tensorboard import SummaryWriter

import wbc_suite
from wbc_suite.evaluation import episode_seeds, success_interval
from wbc_suite.recording import Dataset

CHECKPOINTS = "checkpoint_*.pt"

Act: TypeAlias = Callable[[Mapping[str, Any]], np.ndarray]
"""From an observation to an action of the environment."""
PolicyOf: TypeAlias = Callable[[Mapping[str, Any]], Callable[[Any, Any], Act]]
"""From a checkpoint to a function of environment and generator, called per episode."""


class Settings(dict[str, Any]):
    """The keys of a TOML file, as attributes."""

    def __getattr__(self, name: str) -> Any:
        """Return a value; SystemExit if the file has none of the name."""
        if name not in self:
            raise SystemExit(f"The settings have no '{name}': {', '.join(self)}.")
        return self[name]


def read_settings(path: Path, changes: Sequence[str] = ()) -> Settings:
    """Read a TOML file; changes such as `steps=500` replace its values."""
    settings = tomllib.loads(path.read_text(encoding="utf-8"))
    for change in changes:
        settings |= tomllib.loads(change)
    return Settings(settings)


class Run:
    """A training run in a folder: checkpoints, TensorBoard events, a curve.

    Args:
        settings: Of the run; `folder` and `keep`, the number of checkpoints to keep.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings, self.folder = settings, Path(settings.folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps(settings, indent=1) + "\n"
        (self.folder / "settings.json").write_text(text, encoding="utf-8")
        self.writer = SummaryWriter(str(self.folder / "tensorboard"))
        self.log_file = self.folder / "log.jsonl"

    def save(self, step: int, state: Mapping[str, Any]) -> Path:
        """Save a checkpoint; the oldest are removed."""
        path = self.folder / f"checkpoint_{step:08d}.pt"
        temporary = path.with_suffix(".tmp")
        torch.save({"step": step, **state}, temporary)
        temporary.replace(path)
        for old in self.checkpoints()[: -self.settings.keep]:
            old.unlink()
        return path

    def checkpoints(self) -> list[Path]:
        """Return the checkpoints, oldest first."""
        return sorted(self.folder.glob(CHECKPOINTS))

    def resume(self) -> dict[str, Any] | None:
        """Return the last checkpoint, if there is one."""
        found = self.checkpoints()
        return torch.load(found[-1], weights_only=False) if found else None

    def log(self, step: int, **values: float) -> None:
        """Add scalars to the TensorBoard file and to log.jsonl."""
        for name, value in values.items():
            self.writer.add_scalar(name, value, step)
        with self.log_file.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"step": step, **values}) + "\n")

    def plot(self, *names: str) -> Path:
        """Draw logged values over steps; return the picture's file."""
        import matplotlib

        matplotlib.use("agg")
        from matplotlib import pyplot

        lines = self.log_file.read_text(encoding="utf-8").splitlines()
        rows = [json.loads(line) for line in lines]
        figure, axes = pyplot.subplots(1, len(names), figsize=(5 * len(names), 3.2))
        for each, name in zip(np.atleast_1d(axes), names, strict=True):
            points = [(row["step"], row[name]) for row in rows if name in row]
            each.plot(*np.transpose(points) if points else ([], []), marker=".")
            each.set(xlabel="gradient steps", ylabel=name)
            each.grid(alpha=0.3)
        figure.tight_layout()
        path = self.folder / "curves.png"
        figure.savefig(path, dpi=90)
        return path


class Demonstrations:
    """Observations and actions of recorded episodes, normalised.

    Where actions were disturbed, those that were intended are imitated.

    Attributes:
        observations: Of each episode, shape (steps, observation size).
        actions: Of each episode, shape (steps, action size), between -1 and 1.
        scales: Means and deviations of observations, and bounds of actions; part of a
            checkpoint.
    """

    def __init__(self, path: str, keys: Sequence[str], episodes: int) -> None:
        with Dataset(Path(path)) as dataset:
            names = dataset.names[:episodes]
            if not names:
                raise SystemExit(
                    f"{path} has no episodes: wbc-suite record makes some."
                )
            played = [dataset.episode(name) for name in names]
            seen = [
                np.concatenate([e.columns[f"obs/{key}"] for key in keys], axis=1)
                for e in played
            ]
            acted = [
                np.asarray(e.columns.get("intended", e.columns["actions"]))
                for e in played
            ]
        every, moves = np.concatenate(seen), np.concatenate(acted)
        self.scales = {
            "mean": every.mean(axis=0),
            "deviation": every.std(axis=0) + 1e-3,
            "low": moves.min(axis=0),
            "high": moves.max(axis=0),
        }
        self.observations = [normalised(s, self.scales) for s in seen]
        self.actions = [scaled(a, self.scales) for a in acted]


def normalised(observation: np.ndarray, scales: Mapping[str, np.ndarray]) -> Tensor:
    """Return an observation with zero mean and unit deviation, at most 10."""
    value = (observation - scales["mean"]) / scales["deviation"]
    return torch.as_tensor(np.clip(value, -10.0, 10.0), dtype=torch.float32)


def scaled(action: np.ndarray, scales: Mapping[str, np.ndarray]) -> Tensor:
    """Return an action of the environment as one between -1 and 1."""
    middle, half = _range(scales)
    return torch.as_tensor((action - middle) / half, dtype=torch.float32)


def unscaled(action: Tensor, scales: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return an action between -1 and 1 as one of the environment."""
    middle, half = _range(scales)
    return middle + half * np.clip(action.numpy().astype(np.float64), -1.0, 1.0)


def _range(scales: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    half = 0.5 * (scales["high"] - scales["low"])
    middle = 0.5 * (scales["high"] + scales["low"])
    return middle, np.where(half > 1e-6, half, 1.0)


def observe(observation: Mapping[str, Any], keys: Sequence[str]) -> np.ndarray:
    """Return the observed vectors in one."""
    return np.concatenate([np.ravel(observation[key]) for key in keys])


def success_rate(make_policy: Any, settings: Settings, *, base: int = 1) -> float:
    """Return the share of evaluation episodes that succeed, seeds of a base."""
    env = wbc_suite.make(
        settings.benchmark,
        robots=settings.robots,
        horizon=settings.horizon,
        terminate_on_success=True,
    )
    wins = 0
    for seed in episode_seeds(settings.benchmark, settings.evaluate, base=base):
        observation, _ = env.reset(seed=seed)
        policy, over, info = make_policy(env, np.random.default_rng(seed)), False, {}
        while not over:
            step = env.step(policy(observation))
            observation, _, terminated, truncated, info = step
            over = terminated or truncated
        wins += bool(info["success"])
    env.close()
    return wins / settings.evaluate


def tell(run: Run, policy_of: PolicyOf) -> None:
    """Evaluate the checkpoints that are kept; print the best, the last and the mean.

    The best of several is too good by chance: cite the last, or the mean.
    """
    settings, rates = run.settings, []
    for path in run.checkpoints():
        saved = torch.load(path, weights_only=False)
        rates.append(success_rate(policy_of(saved), settings, base=2))
        run.log(saved["step"], final_success=rates[-1])
    wins, n = round(rates[-1] * settings.evaluate), settings.evaluate
    low, high = success_interval(wins, n)
    print(
        f"Success of the last checkpoint {rates[-1]:.1%} ({low:.1%} to {high:.1%}), "
        f"mean of the last {len(rates)} {np.mean(rates):.1%}, best {max(rates):.1%}; "
        f"{n} episodes each."
    )


def fit(
    run: Run,
    model: nn.Module,
    batch_loss: Callable[[np.random.Generator], Tensor],
    policy_of: PolicyOf,
    *,
    sizes: Mapping[str, int],
    scales: Mapping[str, np.ndarray],
) -> None:
    """Train a model until `steps`, from the last checkpoint of the run on.

    The policy acts with an average of the weights: `average` of it is kept in each
    step, and 0 is none.

    Args:
        run: Where checkpoints and curves go.
        model: The network; `sizes` are the arguments that make it again.
        batch_loss: Returns the loss of a batch that it draws with the generator.
        policy_of: See `tell`.
        sizes: Part of each checkpoint.
        scales: Likewise; see `Demonstrations`.
    """
    settings, first, average = run.settings, 0, copy.deepcopy(model)
    optimiser = torch.optim.AdamW(model.parameters(), lr=settings.learning_rate)
    if (saved := run.resume()) is not None:
        model.load_state_dict(saved["training"])
        average.load_state_dict(saved["model"])
        optimiser.load_state_dict(saved["optimiser"])
        first = saved["step"]
    rng = np.random.default_rng([settings.seed, first])
    for step in range(first + 1, settings.steps + 1):
        loss = batch_loss(rng)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        _blend(average, model, min(settings.average, step / (step + 10.0)))
        if step % settings.save_every == 0 or step == settings.steps:
            state = {
                "model": average.state_dict(),
                "training": model.state_dict(),
                "optimiser": optimiser.state_dict(),
                "sizes": dict(sizes),
                "scales": dict(scales),
                "settings": dict(settings),
            }
            run.save(step, state)
            success = success_rate(policy_of(state), settings)
            run.log(step, loss=loss.item(), success=success)
            print(f"step {step}: loss {loss.item():.4f}, success {success:.1%}")


def last_policy(policy_of: PolicyOf, folder: str) -> Callable[[Any, Any], Act]:
    """Return a policy for `wbc-suite evaluate`: of the last checkpoint of a run.

    The run is the folder `WBC_RUN` of the environment, or else the given one.
    """

    @cache
    def load() -> Callable[[Any, Any], Act]:
        path = sorted(Path(os.environ.get("WBC_RUN", folder)).glob(CHECKPOINTS))[-1]
        return policy_of(torch.load(path, weights_only=False))

    def make(env: Any, rng: Any) -> Act:
        return load()(env, rng)

    return make


def _blend(average: nn.Module, model: nn.Module, keep: float) -> None:
    with torch.no_grad():
        for mean, now in zip(average.parameters(), model.parameters(), strict=True):
            mean.lerp_(now, 1.0 - keep)


def arguments(script: str) -> Settings:
    """Read the settings of a script: its TOML file, and changes on the command line."""
    import argparse

    own = Path(script).with_suffix(".toml")
    parser = argparse.ArgumentParser()
    parser.add_argument("--settings", type=Path, default=own, help=f"{own.name}")
    parser.add_argument("changes", nargs="*", help='such as steps=500 or folder="x"')
    given = parser.parse_args()
    return read_settings(given.settings, given.changes)
