"""Behaviour cloning with history: an LSTM that reads the last observations.

Used like bc.py, which has the commands. History tells apart moments that look alike,
such as closing fingers before and after the grasp.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from training import (
    Act,
    Demonstrations,
    Run,
    Settings,
    arguments,
    fit,
    last_policy,
    normalised,
    observe,
    tell,
    unscaled,
)

State = tuple[Tensor, Tensor] | None


class Recurrent(nn.Module):
    """An LSTM and a layer that gives the action."""

    def __init__(self, *, inputs: int, outputs: int, width: int) -> None:
        super().__init__()
        self.memory = nn.LSTM(inputs, width, num_layers=2, batch_first=True)
        self.head = nn.Linear(width, outputs)

    def forward(self, seen: Tensor, state: State = None) -> tuple[Tensor, State]:
        """Return actions, shape (batch, steps, size), and the memory after them."""
        hidden, state = self.memory(seen, state)
        return torch.tanh(self.head(hidden)), state


class Windows:
    """Windows of demonstrations, drawn at random; early ones repeat the first step."""

    def __init__(self, data: Demonstrations, length: int) -> None:
        self.length = length
        self.seen, self.acted, self.ends = [], [], []
        for k, (seen, acted) in enumerate(
            zip(data.observations, data.actions, strict=True)
        ):
            self.seen.append(torch.cat([seen[:1].expand(length - 1, -1), seen]))
            self.acted.append(torch.cat([acted[:1].expand(length - 1, -1), acted]))
            self.ends += [(k, start) for start in range(len(seen))]

    def draw(self, count: int, rng: np.random.Generator) -> tuple[Tensor, Tensor]:
        """Return observations and actions, shape (count, length, size)."""
        chosen = [self.ends[k] for k in rng.integers(len(self.ends), size=count)]
        seen = [self.seen[k][s : s + self.length] for k, s in chosen]
        acted = [self.acted[k][s : s + self.length] for k, s in chosen]
        return torch.stack(seen), torch.stack(acted)


def train(settings: Settings) -> Run:
    """Train until `steps`, from the last checkpoint on."""
    torch.manual_seed(settings.seed)
    run = Run(settings)
    data = Demonstrations(settings.demonstrations, settings.observed, settings.episodes)
    windows = Windows(data, settings.history)
    sizes = {"inputs": data.observations[0].shape[1], "width": settings.width}
    sizes["outputs"] = data.actions[0].shape[1]
    model = Recurrent(**sizes)

    def batch_loss(rng: np.random.Generator) -> Tensor:
        seen, acted = windows.draw(settings.batch, rng)
        return nn.functional.smooth_l1_loss(model(seen)[0], acted)

    fit(run, model, batch_loss, policy_of, sizes=sizes, scales=data.scales)
    return run


def policy_of(saved: Mapping[str, Any]) -> Callable[[Any, Any], Act]:
    """Return what makes the policy of a checkpoint for an episode.

    As in training, the memory begins anew every `history` steps.
    """
    model = Recurrent(**saved["sizes"])
    model.load_state_dict(saved["model"])
    model.eval()
    settings, scales = saved["settings"], saved["scales"]

    def make(env: Any, rng: Any) -> Act:
        del env, rng
        state: State = None
        count = 0

        def act(observation: Mapping[str, Any]) -> np.ndarray:
            nonlocal state, count
            if count % settings["history"] == 0:
                state = None
            count += 1
            seen = normalised(observe(observation, settings["observed"]), scales)
            with torch.inference_mode():
                output, state = model(seen[None, None], state)
            return unscaled(output[0, 0], scales)

        return act

    return make


Policy = last_policy(policy_of, "artifacts/learning/bc_history")

if __name__ == "__main__":
    finished = train(arguments(__file__))
    tell(finished, policy_of)
    print(finished.plot("loss", "success", "final_success"))
