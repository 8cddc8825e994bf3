"""A small diffusion policy on states: it draws the next actions from noise.

Used like bc.py, which has the commands. The network predicts a chunk of actions from
the same with noise; denoising in a few steps gives a chunk, of which the first actions
are taken.

Sources: Chi et al. (2023), "Diffusion Policy", RSS; Song et al. (2021), "Denoising
Diffusion Implicit Models", ICLR (the sampler); Nichol and Dhariwal (2021), "Improved
Denoising Diffusion Probabilistic Models", ICML (the schedule).
"""

import math

import numpy as np
import torch
from imitation import Method, last_policy, main
from torch import Tensor, nn
from training import arguments

LEVELS = 100  # of noise
DENOISING = 10  # steps that remove it


def signal_shares() -> Tensor:
    """Return the share of the signal's variance at each level, a squared cosine."""
    t = torch.linspace(0.0, 1.0, LEVELS + 1)[1:]
    share = torch.cos((t + 0.008) / 1.008 * math.pi / 2.0) ** 2
    return (share / math.cos(0.008 / 1.008 * math.pi / 2.0) ** 2).clamp(1e-4, 1.0)


SHARES = signal_shares()


class Denoiser(nn.Module):
    """Predicts a chunk of actions from a noisy one and the observations before it."""

    def __init__(
        self, *, inputs: int, outputs: int, history: int, chunk: int, width: int
    ) -> None:
        super().__init__()
        self.shape = (chunk, outputs)
        self.register_buffer("rates", torch.exp(torch.linspace(0.0, -6.0, 16)))
        self.first = nn.Linear(inputs * history + outputs * chunk + 32, width)
        self.blocks = nn.ModuleList(
            nn.Sequential(nn.LayerNorm(width), nn.Linear(width, width), nn.Mish())
            for _ in range(3)
        )
        self.last = nn.Linear(width, outputs * chunk)

    def forward(self, noisy: Tensor, level: Tensor, seen: Tensor) -> Tensor:
        """Return actions of the shape of `noisy`; `level` has shape (batch,)."""
        phase = level[:, None] * self.get_buffer("rates")
        known = [noisy.flatten(1), seen.flatten(1), phase.sin(), phase.cos()]
        hidden = nn.functional.mish(self.first(torch.cat(known, dim=1)))
        for block in self.blocks:
            hidden = hidden + block(hidden)
        return self.last(hidden).view_as(noisy)


def loss(
    model: nn.Module, seen: Tensor, acted: Tensor, rng: np.random.Generator
) -> Tensor:
    """Return the mean squared error of the actions, at levels drawn at random."""
    level = torch.as_tensor(rng.integers(LEVELS, size=len(seen)))
    noise = torch.as_tensor(rng.standard_normal(acted.shape, dtype=np.float32))
    share = SHARES[level][:, None, None]
    noisy = share.sqrt() * acted + (1.0 - share).sqrt() * noise
    return nn.functional.mse_loss(model(noisy, level.float(), seen), acted)


def draw(model: nn.Module, seen: Tensor, rng: np.random.Generator) -> Tensor:
    """Return a chunk of actions, by DDIM in a few steps from noise."""
    assert isinstance(model, Denoiser)
    start = rng.standard_normal((len(seen), *model.shape), dtype=np.float32)
    chunk, one = torch.as_tensor(start), torch.ones(1)
    levels = torch.linspace(LEVELS - 1, 0, DENOISING).round().long()
    for k, level in enumerate(levels):
        clean = model(chunk, level.expand(len(seen)).float(), seen).clamp(-1.0, 1.0)
        share = SHARES[level]
        after = SHARES[levels[k + 1]] if k + 1 < DENOISING else one
        noise = (chunk - share.sqrt() * clean) / (1.0 - share).sqrt()
        chunk = after.sqrt() * clean + (1.0 - after).sqrt() * noise
    return chunk


METHOD = Method(network=Denoiser, loss=loss, draw=draw)
Policy = last_policy(METHOD, "artifacts/learning/diffusion")

if __name__ == "__main__":
    main(arguments(__file__), METHOD)
