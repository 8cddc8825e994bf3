"""One file of PyTorch in the style of CleanRL: REINFORCE with a baseline on Lift.

Install: pip install -e . -r examples/clients/cleanrl_style.txt
Shows:   `gymnasium.make_vec` with environments of one process, autoreset, statistics.
"""

import sys

import gymnasium
import numpy as np
import torch
from gymnasium.wrappers import vector as wrappers

import wbc_suite
from wbc_suite.wrappers import Flat

iterations = int(sys.argv[1]) if len(sys.argv) > 1 else 5
HORIZON, ENVS = 50, 4
torch.manual_seed(0)
envs = gymnasium.make_vec(
    "wbc_suite/Lift-v1",
    num_envs=ENVS,
    vectorization_mode="sync",
    wrappers=[Flat],
    reward_shaping=True,
    horizon=HORIZON,
)
envs = wrappers.RecordEpisodeStatistics(envs)
size, actions = (
    envs.single_observation_space.shape[0],
    envs.single_action_space.shape[0],
)
policy = torch.nn.Sequential(
    torch.nn.LayerNorm(size), torch.nn.Linear(size, 64), torch.nn.Tanh(),
    torch.nn.Linear(64, actions), torch.nn.Tanh(),
)  # fmt: skip
optimiser = torch.optim.Adam(policy.parameters(), lr=3e-3)
for iteration in range(iterations):
    seen, _ = envs.reset(seed=iteration * ENVS)
    logs, rewards = [], []
    for _ in range(HORIZON):
        means = policy(torch.as_tensor(seen))
        draws = torch.distributions.Normal(means, 0.2)
        action = draws.sample()
        seen, reward, _, truncated, info = envs.step(action.clamp(-1, 1).numpy())
        logs.append(draws.log_prob(action).sum(dim=1))
        rewards.append(reward)
    assert truncated.all(), "all episodes end at the horizon"
    returns = torch.as_tensor(np.cumsum(rewards[::-1], axis=0)[::-1].copy()).float()
    advantage = (returns - returns.mean()) / (returns.std() + 1e-6)
    loss = -(torch.stack(logs) * advantage).mean()
    optimiser.zero_grad()
    loss.backward()
    optimiser.step()
    print(f"iteration {iteration}: mean return {info['episode']['r'].mean():.2f}")
print(f"wbc_suite {wbc_suite.__version__}, torch {torch.__version__}")
