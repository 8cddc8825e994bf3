"""Behaviour cloning: a network that gives the next actions of demonstrations.

Record first, then train; a stopped run goes on where it stopped:

    wbc-suite record Lift --only-success --episodes 200 --noise 0.05 --recoveries 4
        --out artifacts/lift.hdf5
    .venv-learning/bin/python examples/learning/bc.py
    wbc-suite evaluate Lift --policy bc:Policy        # PYTHONPATH=examples/learning
"""

import numpy as np
from imitation import Method, last_policy, main
from torch import Tensor, nn
from training import arguments


def network(
    *, inputs: int, outputs: int, history: int, chunk: int, width: int
) -> nn.Module:
    """Return a network of two hidden layers."""
    return nn.Sequential(
        nn.Flatten(),
        *(nn.Linear(inputs * history, width), nn.LayerNorm(width), nn.ReLU()),
        *(nn.Linear(width, width), nn.LayerNorm(width), nn.ReLU()),
        *(nn.Linear(width, outputs * chunk), nn.Unflatten(1, (chunk, outputs))),
    )


def loss(
    model: nn.Module, seen: Tensor, acted: Tensor, rng: np.random.Generator
) -> Tensor:
    """Return the mean absolute error; of two ways it favours one, not their mean."""
    del rng
    return nn.functional.l1_loss(model(seen), acted)


def draw(model: nn.Module, seen: Tensor, rng: np.random.Generator) -> Tensor:
    """Return the actions of the network."""
    del rng
    return model(seen)


METHOD = Method(network=network, loss=loss, draw=draw)
Policy = last_policy(METHOD, "artifacts/learning/bc")

if __name__ == "__main__":
    main(arguments(__file__), METHOD)
