"""What the imitating scripts share: demonstrations, policies of chunks, evaluation."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import torch
from torch import Tensor, nn
from training import TRAINED, Run, Settings, fit, last_checkpoint, read_checkpoint

import wbc_suite
from wbc_suite.evaluation import episode_seeds, success_interval
from wbc_suite.recording import Dataset

SAVED = (*TRAINED, "sizes", "scales", "keys")  # of a checkpoint

Act: TypeAlias = Callable[[Mapping[str, Any]], np.ndarray]
"""From an observation to an action of the environment."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Method:
    """A way to imitate.

    Observations have shape (batch, history, size) and actions (batch, chunk, size), all
    normalised.

    Attributes:
        network: Makes one from `inputs`, `outputs`, `history`, `chunk` and `width`.
        loss: Of the network on observations and actions; draws with the generator.
        draw: Returns the network's actions for observations.
    """

    network: Callable[..., nn.Module]
    loss: Callable[[nn.Module, Tensor, Tensor, np.random.Generator], Tensor]
    draw: Callable[[nn.Module, Tensor, np.random.Generator], Tensor]


class Demonstrations:
    """Observations and actions of recorded episodes, normalised.

    Where actions were disturbed, those that were intended are imitated.

    Attributes:
        observations: Of each episode, shape (steps, observation size).
        actions: Of each episode, shape (steps, action size), between -1 and 1.
        keys: Of what is observed.
        scales: Means and deviations of observations, and bounds of actions; part of a
            checkpoint.
    """

    def __init__(self, path: str, patterns: Sequence[str], episodes: int) -> None:
        seen, acted = [], []
        with Dataset(Path(path)) as dataset:
            for name in dataset.names[:episodes]:
                columns = dataset.episode(name).columns
                known = {k[4:]: v for k, v in columns.items() if k[:4] == "obs/"}
                self.keys = [
                    key for p in patterns for key in sorted(known) if fnmatch(key, p)
                ]
                seen.append(observe(known, self.keys))
                acted.append(np.asarray(columns.get("intended", columns["actions"])))
        if not seen:
            raise SystemExit(f"{path} has no episodes: wbc-suite record makes some.")
        every, moves = np.concatenate(seen), np.concatenate(acted)
        self.scales = {
            "mean": every.mean(axis=0),
            "deviation": every.std(axis=0) + 1e-3,
            "low": moves.min(axis=0),
            "high": moves.max(axis=0),
        }
        ends = (moves == self.scales["low"]) | (moves == self.scales["high"])
        self.scales["binary"] = ends.all(axis=0)
        self.observations = [normalised(s, self.scales) for s in seen]
        changes = torch.cat([each.diff(dim=0) for each in self.observations])
        self.scales["change"] = changes.std(dim=0).numpy() + 1e-3
        self.actions = [scaled(a, self.scales) for a in acted]

    def windows(self, history: int, chunk: int) -> tuple[Tensor, Tensor]:
        """Return each moment's last observations and next actions.

        Shapes are (moments, history, size) and (moments, chunk, size). Before the start
        the first observation is repeated, after the end the last action.
        """
        seen, acted = [], []
        for before, after in zip(self.observations, self.actions, strict=True):
            first = before[:1].expand(history - 1, -1)
            last = after[-1:].expand(chunk - 1, -1)
            seen.append(torch.cat([first, before]).unfold(0, history, 1))
            acted.append(torch.cat([after, last]).unfold(0, chunk, 1))
        return torch.cat(seen).mT.contiguous(), torch.cat(acted).mT.contiguous()


def as_changes(seen: Tensor, scales: Mapping[str, np.ndarray]) -> Tensor:
    """Return the last observations as changes, of unit deviation, and the last one.

    Between two actions a hand moves by hundredths of what it moves in an episode, so
    that a network hardly sees velocities in the difference of two observations.
    """
    changes = seen.diff(dim=-2) / torch.as_tensor(scales["change"]).float()
    return torch.cat([changes, seen[..., -1:, :]], dim=-2)


def normalised(observation: np.ndarray, scales: Mapping[str, np.ndarray]) -> Tensor:
    """Return an observation with zero mean and unit deviation, at most 10."""
    value = (observation - scales["mean"]) / scales["deviation"]
    return torch.as_tensor(np.clip(value, -10.0, 10.0), dtype=torch.float32)


def scaled(action: np.ndarray, scales: Mapping[str, np.ndarray]) -> Tensor:
    """Return an action of the environment as one between -1 and 1."""
    middle, half = _range(scales)
    return torch.as_tensor((action - middle) / half, dtype=torch.float32)


def unscaled(action: Tensor, scales: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return an action between -1 and 1 as one of the environment.

    A value that was always one of two, such as a gripper's, is one of them.
    """
    middle, half = _range(scales)
    value = np.clip(action.numpy().astype(np.float64), -1.0, 1.0)
    value = np.where(scales["binary"], np.where(value > 0.0, 1.0, -1.0), value)
    return middle + half * value


def _range(scales: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    half = 0.5 * (scales["high"] - scales["low"])
    middle = 0.5 * (scales["high"] + scales["low"])
    return middle, np.where(half > 1e-6, half, 1.0)


def observe(observation: Mapping[str, Any], keys: Sequence[str]) -> np.ndarray:
    """Return the observed vectors in one, along the last axis.

    Of orientations it has two columns of the rotation matrix: a quaternion and its
    negative are the same, and a network should not see them jump.
    """
    parts = [np.asarray(observation[key]) for key in keys]
    return np.concatenate(
        [
            _columns(part) if key.endswith("_quat") else part
            for key, part in zip(keys, parts, strict=True)
        ],
        axis=-1,
    )


def _columns(quat_xyzw: np.ndarray) -> np.ndarray:
    """Return two columns of rotation matrices, shape (..., 6).

    Source: Zhou et al. (2019), "On the Continuity of Rotation Representations in Neural
    Networks", CVPR.
    """
    x, y, z, w = np.moveaxis(quat_xyzw, -1, 0)
    first = 1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)
    second = 2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)
    return np.stack([*first, *second], axis=-1)


def train(settings: Settings, method: Method) -> Run:
    """Train until `steps`, from the last checkpoint on."""
    torch.set_num_threads(settings.threads)
    torch.manual_seed(settings.seed)
    run = Run(settings)
    data = Demonstrations(settings.demonstrations, settings.observed, settings.episodes)
    seen, acted = data.windows(settings.history, settings.chunk)
    seen = as_changes(seen, data.scales)
    sizes = {"inputs": seen.shape[2], "outputs": acted.shape[2]}
    sizes |= {name: settings[name] for name in ("history", "chunk", "width")}
    model = method.network(**sizes)

    def batch_loss(rng: np.random.Generator) -> Tensor:
        rows = torch.as_tensor(rng.integers(len(seen), size=settings.batch))
        return method.loss(model, seen[rows], acted[rows], rng)

    scales = {name: torch.as_tensor(value) for name, value in data.scales.items()}
    facts = {"sizes": sizes, "scales": scales, "keys": data.keys}
    fit(run, model, batch_loss, facts)
    return run


class Policies:
    """The policy of a checkpoint: call it with environment and generator per episode.

    The last `history` observations give `chunk` actions, of which `taken` are taken.
    """

    def __init__(self, saved: Mapping[str, Any], method: Method) -> None:
        self.model, self.method = method.network(**saved["sizes"]), method
        self.model.load_state_dict(saved["model"])
        self.model.eval()
        self.settings, self.keys = Settings(saved["settings"]), saved["keys"]
        self.scales = {name: value.numpy() for name, value in saved["scales"].items()}
        torch.set_num_threads(self.settings.threads)

    def __call__(self, env: Any, rng: np.random.Generator) -> Act:
        """Return the policy of an episode."""
        del env
        past: list[Tensor] = []
        waiting: list[Tensor] = []

        def act(observation: Mapping[str, Any]) -> np.ndarray:
            now = normalised(observe(observation, self.keys), self.scales)
            past.extend([now] * (1 if past else self.settings.history))
            del past[: -self.settings.history]
            if not waiting:
                seen = as_changes(torch.stack(past)[None], self.scales)
                with torch.inference_mode():
                    drawn = self.method.draw(self.model, seen, rng)
                waiting.extend(drawn[0, : self.settings.taken])
            return unscaled(waiting.pop(0), self.scales)

        return act


def last_policy(method: Method, folder: str) -> Callable[[Any, Any], Act]:
    """Return a policy for `wbc-suite evaluate`: of the last checkpoint of a run.

    The run is the folder `WBC_RUN` of the environment, or else the given one.
    """

    @cache
    def load() -> Policies:
        return Policies(read_checkpoint(last_checkpoint(folder), SAVED), method)

    def make(env: Any, rng: np.random.Generator) -> Act:
        return load()(env, rng)

    return make


def success_rate(policies: Policies, settings: Settings, *, base: int = 2) -> float:
    """Return the share of `evaluate` episodes that succeed, seeds of a base."""
    env = wbc_suite.make(
        settings.benchmark,
        robots=settings.robots,
        horizon=settings.horizon,
        terminate_on_success=True,
    )
    wins = 0
    for seed in episode_seeds(settings.benchmark, settings.evaluate, base=base):
        observation, info = env.reset(seed=seed)
        policy, over = policies(env, np.random.default_rng(seed)), False
        while not over:
            step = env.step(policy(observation))
            observation, _, terminated, truncated, info = step
            over = terminated or truncated
        wins += bool(info["success"])
    env.close()
    return wins / settings.evaluate


def evaluate(run: Run, method: Method) -> dict[str, float]:
    """Return success of the checkpoints that are kept: the last, the mean, the best.

    The best of several is too good by chance: cite the last, or the mean.
    """
    rates = []
    for path in run.checkpoints():
        saved = read_checkpoint(path, SAVED)
        rates.append(success_rate(Policies(saved, method), run.settings))
        run.log(saved["step"], success=rates[-1])
    return {"last": rates[-1], "mean": float(np.mean(rates)), "best": max(rates)}


def main(settings: Settings, method: Method) -> None:
    """Train, evaluate, print and draw."""
    run = train(settings, method)
    found, n = evaluate(run, method), settings.evaluate
    low, high = success_interval(round(found["last"] * n), n)
    last = f"{found['last']:.1%} ({low:.1%} to {high:.1%})"
    print(
        f"Success of the last checkpoint {last}, mean of the last "
        f"{len(run.checkpoints())} {found['mean']:.1%}, best {found['best']:.1%}; "
        f"{n} episodes each. {run.plot('loss', 'success')}"
    )
