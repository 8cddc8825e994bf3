"""Behaviour cloning: a network that imitates demonstrations, action by action.

Record first, then train; a stopped run goes on where it stopped:

    wbc-suite record Lift --device expert --episodes 200 --out artifacts/lift.hdf5
    .venv-learning/bin/python examples/learning/bc.py
    wbc-suite evaluate Lift --policy bc:Policy        # PYTHONPATH=examples/learning
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


def network(inputs: int, outputs: int, width: int) -> nn.Module:
    """Return a network of two hidden layers."""
    return nn.Sequential(
        *(nn.Linear(inputs, width), nn.ReLU()),
        *(nn.Linear(width, width), nn.ReLU()),
        *(nn.Linear(width, outputs), nn.Tanh()),
    )


def train(settings: Settings) -> Run:
    """Train until `steps`, from the last checkpoint on."""
    torch.manual_seed(settings.seed)
    run = Run(settings)
    data = Demonstrations(settings.demonstrations, settings.observed, settings.episodes)
    seen, acted = torch.cat(data.observations), torch.cat(data.actions)
    sizes = {"inputs": seen.shape[1], "outputs": acted.shape[1]}
    sizes["width"] = settings.width
    model = network(**sizes)

    def batch_loss(rng: np.random.Generator) -> Tensor:
        rows = torch.as_tensor(rng.integers(len(seen), size=settings.batch))
        return nn.functional.smooth_l1_loss(model(seen[rows]), acted[rows])

    fit(run, model, batch_loss, policy_of, sizes=sizes, scales=data.scales)
    return run


def policy_of(saved: Mapping[str, Any]) -> Callable[[Any, Any], Act]:
    """Return what makes the policy of a checkpoint for an episode."""
    model = network(**saved["sizes"])
    model.load_state_dict(saved["model"])
    model.eval()
    keys, scales = saved["settings"]["observed"], saved["scales"]

    def make(env: Any, rng: Any) -> Act:
        del env, rng

        def act(observation: Mapping[str, Any]) -> np.ndarray:
            with torch.inference_mode():
                output: Tensor = model(normalised(observe(observation, keys), scales))
            return unscaled(output, scales)

        return act

    return make


Policy = last_policy(policy_of, "artifacts/learning/bc")

if __name__ == "__main__":
    finished = train(arguments(__file__))
    tell(finished, policy_of)
    print(finished.plot("loss", "success", "final_success"))
