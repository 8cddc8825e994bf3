"""What the learning scripts share: settings, checkpoints, curves, gradient steps."""

import copy
import json
import math
import os
import tomllib
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.utils.tensorboard import SummaryWriter

CHECKPOINTS = "checkpoint_*.pt"
TRAINED = ("step", "model", "training", "optimiser", "settings")  # keys of a checkpoint
WARM_UP = 100  # gradient steps


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
        """Save a checkpoint of tensors and plain values; the oldest are removed."""
        path = self.folder / f"checkpoint_{step:08d}.pt"
        write_checkpoint(path, {"step": step, **state})
        for old in self.checkpoints()[: -self.settings.keep]:
            old.unlink()
        return path

    def checkpoints(self) -> list[Path]:
        """Return the checkpoints, oldest first."""
        return sorted(self.folder.glob(CHECKPOINTS))

    def resume(self) -> dict[str, Any] | None:
        """Return the last checkpoint, if there is one."""
        found = self.checkpoints()
        return read_checkpoint(found[-1], TRAINED) if found else None

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


def fit(
    run: Run,
    model: nn.Module,
    batch_loss: Callable[[np.random.Generator], Tensor],
    facts: Mapping[str, Any],
) -> None:
    """Train a model until `steps`, from the last checkpoint of the run on.

    The rate of learning falls to zero as half a cosine. Checkpoints hold an average of
    the weights as `model`: `average` of it is kept in each step.

    Args:
        run: Where checkpoints and curves go.
        model: The network.
        batch_loss: Returns the loss of a batch that it draws with the generator.
        facts: Further parts of each checkpoint.
    """
    settings, first, average = run.settings, 0, copy.deepcopy(model)
    optimiser = torch.optim.AdamW(
        model.parameters(), lr=settings.learning_rate, fused=True
    )
    if (saved := run.resume()) is not None:
        model.load_state_dict(saved["training"])
        average.load_state_dict(saved["model"])
        optimiser.load_state_dict(saved["optimiser"])
        first = saved["step"]
    rng, losses = np.random.default_rng([settings.seed, first]), list[float]()
    for step in range(first + 1, settings.steps + 1):
        share = min(
            step / WARM_UP, 0.5 + 0.5 * math.cos(math.pi * step / settings.steps)
        )
        for group in optimiser.param_groups:
            group["lr"] = settings.learning_rate * share
        loss = batch_loss(rng)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(loss.item())
        _blend(average, model, min(settings.average, step / (step + 10.0)))
        if step % settings.save_every == 0 or step == settings.steps:
            state = {
                "model": average.state_dict(),
                "training": model.state_dict(),
                "optimiser": optimiser.state_dict(),
                "settings": dict(settings),
            }
            run.save(step, state | dict(facts))
            run.log(step, loss=float(np.mean(losses)))
            print(f"step {step}: loss {np.mean(losses):.4f}", flush=True)
            losses.clear()


def write_checkpoint(path: Path, state: Mapping[str, Any]) -> None:
    """Write a file that is complete, or absent."""
    temporary = path.with_suffix(".tmp")
    torch.save(dict(state), temporary)
    temporary.replace(path)


def read_checkpoint(path: Path, keys: Collection[str]) -> dict[str, Any]:
    """Read a file of `write_checkpoint`; SystemExit if it is none, or lacks a key.

    Tensors, numbers, text and containers of them are restored. Nothing in a file is
    executed, as the pickles that torch reads without `weights_only` would be.
    """
    try:
        saved = torch.load(path, weights_only=True)
    except Exception as error:  # torch raises a dozen kinds
        raise SystemExit(
            f"'{path}' is damaged, or holds objects besides tensors, numbers and text, "
            "which are not loaded. Delete it, or name another folder."
        ) from error
    missing = set(keys) - set(saved if isinstance(saved, dict) else ())
    if missing:
        raise SystemExit(f"'{path}' has no {', '.join(sorted(missing))}.")
    return saved


def last_checkpoint(folder: str) -> Path:
    """Return the last checkpoint of a folder, or of `WBC_RUN` of the environment."""
    found = sorted(Path(os.environ.get("WBC_RUN", folder)).glob(CHECKPOINTS))
    if not found:
        raise SystemExit(f"No checkpoint in {folder}: train first, or set WBC_RUN.")
    return found[-1]


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
