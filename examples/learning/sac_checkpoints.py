"""Checkpoints of sac.py: parameters as tensors, replay buffers as plain arrays.

What the two libraries save themselves are pickles: to load one executes what it holds.
"""

from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback
from training import read_checkpoint, write_checkpoint

CHECKPOINTS = "sac_*_steps.pt"
COLUMNS = (
    *("observations", "next_observations", "actions"),
    *("rewards", "dones", "timeouts"),
)
"""Arrays of a replay buffer, shape (rows, environments, ...)."""
BUFFERS = 2  # that are kept: each takes up to a gigabyte


class Checkpoints(BaseCallback):
    """Writes a checkpoint and its replay buffer every `every` steps of the vector."""

    def __init__(self, folder: Path, every: int) -> None:
        super().__init__()
        self.folder, self.every = folder, every

    def _on_step(self) -> bool:
        if self.n_calls % self.every == 0:
            path = self.folder / f"sac_{self.num_timesteps}_steps.pt"
            write_buffer(buffer_of(path), self.model.replay_buffer)
            write_checkpoint(path, parameters(self.model))
            for old in saved(self.folder)[:-BUFFERS]:
                buffer_of(old).unlink(missing_ok=True)
        return True


def saved(folder: Path) -> list[Path]:
    """Return the checkpoints, oldest first."""
    found = folder.glob(CHECKPOINTS)
    return sorted(found, key=lambda path: int(path.stem.split("_")[1]))


def buffer_of(checkpoint: Path) -> Path:
    """Return the file of a checkpoint's replay buffer."""
    _, step, _ = checkpoint.stem.split("_")
    return checkpoint.with_name(f"sac_replay_buffer_{step}_steps.npz")


def resume(model: Any, folder: Path) -> None:
    """Continue from the last checkpoint of a folder that can be read, if it has any.

    Raises:
        SystemExit: If the folder has checkpoints, of which none can be read.
    """
    reasons = []
    for path in reversed(saved(folder)):
        try:
            state = read_checkpoint(path, parameters(model))
            read_buffer(buffer_of(path), model.replay_buffer)
        except SystemExit as reason:
            reasons.append(str(reason))
            print(f"{reason} The checkpoint before it is tried.")
        else:
            restore(model, state)
            return
    if reasons:
        raise SystemExit(f"No checkpoint in '{folder}' can be read. {reasons[0]}")


def parameters(model: Any) -> dict[str, Any]:
    """Return all that a model has learnt, as tensors and numbers."""
    step = {"step": model.num_timesteps}
    if not hasattr(model, "log_ent_coef"):  # sbx
        import jax

        leaves = jax.tree.leaves(_learnt(model))
        return step | {"leaves": [torch.from_numpy(np.array(leaf)) for leaf in leaves]}
    entropy = model.log_ent_coef.detach()
    return step | {"modules": model.get_parameters(), "log_ent_coef": entropy}


def restore(model: Any, state: dict[str, Any]) -> None:
    """Give a model the parameters of a checkpoint; its settings are those it has.

    Raises:
        SystemExit: If they are those of a network of other sizes.
    """
    if "leaves" not in state:
        try:
            model.set_parameters(state["modules"])
        except (RuntimeError, ValueError) as error:
            raise SystemExit(f"The checkpoint is of other networks: {error}") from error
        with torch.no_grad():
            model.log_ent_coef.copy_(state["log_ent_coef"])
    else:
        import jax

        now, tree = jax.tree.flatten(_learnt(model))
        leaves = [jax.numpy.asarray(leaf.numpy()) for leaf in state["leaves"]]
        if [*map(np.shape, leaves)] != [*map(np.shape, now)]:
            raise SystemExit("The checkpoint is of networks of other sizes.")
        policy, learnt = model.policy, jax.tree.unflatten(tree, leaves)
        policy.actor_state, policy.qf_state, model.ent_coef_state, model.key = learnt
    model.num_timesteps = state["step"]


def _learnt(model: Any) -> tuple[Any, ...]:
    """Return the states of the networks of sbx, and of its random generator."""
    policy = model.policy
    return policy.actor_state, policy.qf_state, model.ent_coef_state, model.key


def write_buffer(path: Path, buffer: Any) -> None:
    """Write the rows of a replay buffer that are filled: a whole file, or none."""
    rows = buffer.size()
    arrays = {name: getattr(buffer, name)[:rows] for name in COLUMNS}
    temporary = path.with_suffix(".tmp")
    with temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, next=buffer.pos, **arrays)
    temporary.replace(path)


def read_buffer(path: Path, buffer: Any) -> None:
    """Fill a replay buffer with the rows of a file.

    Raises:
        SystemExit: If the file cannot be read, or is of another buffer; then the
            buffer has not changed.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in COLUMNS}
            position = int(file["next"])
    except Exception as error:  # NumPy raises a dozen kinds
        raise SystemExit(f"'{path}' is no replay buffer: {error}.") from error
    rows, size = len(arrays["rewards"]), buffer.buffer_size
    fits = position == rows if rows < size else rows == size and 0 <= position < size
    for name, array in arrays.items():
        kept = getattr(buffer, name)
        fits = fits and array.shape == (rows, *kept.shape[1:])
        fits = fits and array.dtype == kept.dtype
    if not fits:
        raise SystemExit(f"'{path}' is of other environments, or of another size.")
    for name, array in arrays.items():
        getattr(buffer, name)[:rows] = array
    buffer.pos, buffer.full = position, rows == size
