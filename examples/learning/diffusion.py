"""A small diffusion policy on states: it draws the next actions from noise.

Used like bc.py, which has the commands. The network predicts the noise that was added
to a chunk of actions; denoising in a few steps gives a chunk, of which the first
actions are taken.

Sources: Chi et al. (2023), "Diffusion Policy", RSS; Song et al. (2021), "Denoising
Diffusion Implicit Models", ICLR (the sampler); Nichol and Dhariwal (2021), "Improved
Denoising Diffusion Probabilistic Models", ICML (the schedule).
"""

import math
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

LEVELS = 100  # of noise


def signal_shares() -> Tensor:
    """Return the share of the signal's variance at each level, a squared cosine."""
    t = torch.linspace(0.0, 1.0, LEVELS + 1)[1:]
    share = torch.cos((t + 0.008) / 1.008 * math.pi / 2.0) ** 2
    return (share / math.cos(0.008 / 1.008 * math.pi / 2.0) ** 2).clamp(1e-4, 1.0)


class Denoiser(nn.Module):
    """Predicts the noise in a chunk of actions from the observations before it."""

    def __init__(self, *, inputs: int, outputs: int, width: int) -> None:
        super().__init__()
        self.register_buffer("rates", torch.exp(torch.linspace(0.0, -6.0, 16)))
        self.first = nn.Linear(inputs + outputs + 32, width)
        self.blocks = nn.ModuleList(
            nn.Sequential(nn.LayerNorm(width), nn.Linear(width, width), nn.Mish())
            for _ in range(4)
        )
        self.last = nn.Linear(width, outputs)

    def forward(self, noisy: Tensor, level: Tensor, seen: Tensor) -> Tensor:
        """Return the noise, shape (batch, outputs); `level` has shape (batch,)."""
        phase = level[:, None] * self.get_buffer("rates")
        known = torch.cat([noisy, seen, phase.sin(), phase.cos()], dim=1)
        hidden = nn.functional.mish(self.first(known))
        for block in self.blocks:
            hidden = hidden + block(hidden)
        return self.last(hidden)


def sample(
    model: Denoiser, seen: Tensor, *, size: int, steps: int, seed: int
) -> Tensor:
    """Return a chunk of actions, shape (size,), by DDIM in so many steps."""
    shares, generator = signal_shares(), torch.Generator().manual_seed(seed)
    chunk = torch.randn(1, size, generator=generator)
    levels = torch.linspace(LEVELS - 1, 0, steps).round().long()
    for k, level in enumerate(levels):
        noise = model(chunk, level[None].float(), seen[None])
        share = shares[level]
        clean = ((chunk - (1.0 - share).sqrt() * noise) / share.sqrt()).clamp(-1.0, 1.0)
        after = shares[levels[k + 1]] if k + 1 < steps else torch.tensor(1.0)
        noise = (chunk - share.sqrt() * clean) / (1.0 - share).sqrt()
        chunk = after.sqrt() * clean + (1.0 - after).sqrt() * noise
    return chunk[0]


def chunks(data: Demonstrations, settings: Settings) -> tuple[Tensor, Tensor]:
    """Return every moment's last observations, and its next actions, one row each."""
    seen, acted = [], []
    for before, after in zip(data.observations, data.actions, strict=True):
        first = before[:1].expand(settings.history - 1, -1)
        last = after[-1:].expand(settings.chunk - 1, -1)
        past, future = torch.cat([first, before]), torch.cat([after, last])
        for k in range(len(before)):
            seen.append(past[k : k + settings.history].flatten())
            acted.append(future[k : k + settings.chunk].flatten())
    return torch.stack(seen), torch.stack(acted)


def train(settings: Settings) -> Run:
    """Train until `steps`, from the last checkpoint on."""
    torch.manual_seed(settings.seed)
    run = Run(settings)
    data = Demonstrations(settings.demonstrations, settings.observed, settings.episodes)
    seen, acted = chunks(data, settings)
    sizes = {"inputs": seen.shape[1], "outputs": acted.shape[1]}
    sizes["width"] = settings.width
    model, shares = Denoiser(**sizes), signal_shares()

    def batch_loss(rng: np.random.Generator) -> Tensor:
        rows = torch.as_tensor(rng.integers(len(seen), size=settings.batch))
        level = torch.as_tensor(rng.integers(LEVELS, size=settings.batch))
        noise = torch.as_tensor(rng.standard_normal(acted[rows].shape)).float()
        share = shares[level][:, None]
        noisy = share.sqrt() * acted[rows] + (1.0 - share).sqrt() * noise
        return nn.functional.mse_loss(model(noisy, level.float(), seen[rows]), noise)

    fit(run, model, batch_loss, policy_of, sizes=sizes, scales=data.scales)
    return run


def policy_of(saved: Mapping[str, Any]) -> Callable[[Any, Any], Act]:
    """Return what makes the policy of a checkpoint for an episode."""
    model = Denoiser(**saved["sizes"])
    model.load_state_dict(saved["model"])
    model.eval()
    settings, scales = Settings(saved["settings"]), saved["scales"]
    size = saved["sizes"]["outputs"]

    def make(env: Any, rng: Any) -> Act:
        del env
        past: list[Tensor] = []
        waiting: list[Tensor] = []

        def act(observation: Mapping[str, Any]) -> np.ndarray:
            past.append(normalised(observe(observation, settings.observed), scales))
            del past[: -settings.history]
            if not waiting:
                first = [past[0]] * (settings.history - len(past))
                seen, seed = torch.cat([*first, *past]), int(rng.integers(2**31))
                with torch.inference_mode():
                    drawn = sample(
                        model, seen, size=size, steps=settings.denoising, seed=seed
                    )
                waiting.extend(drawn.reshape(settings.chunk, -1)[: settings.taken])
            return unscaled(waiting.pop(0), scales)

        return act

    return make


Policy = last_policy(policy_of, "artifacts/learning/diffusion")

if __name__ == "__main__":
    finished = train(arguments(__file__))
    tell(finished, policy_of)
    print(finished.plot("loss", "success", "final_success"))
