"""Hindsight experience replay of Stable-Baselines3 on a goal version of Lift.

Install: pip install -e . -r examples/clients/sb3_her.txt
Shows:   `wbc_suite/Lift-Goal-v0` as a goal environment, relabelled goals in the buffer.
"""

import sys

import gymnasium
import numpy as np
import torch
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.env_checker import check_env

import wbc_suite

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 150
torch.set_num_threads(1)

env = gymnasium.make("wbc_suite/Lift-Goal-v0", robots="Panda", horizon=50)
check_env(env, skip_render_check=True)
model = SAC(
    "MultiInputPolicy",
    env,
    replay_buffer_class=HerReplayBuffer,
    replay_buffer_kwargs={"n_sampled_goal": 4},
    learning_starts=50,
    seed=0,
)
model.learn(steps)
batch = model.replay_buffer.sample(256)
rewards = batch.rewards.numpy().ravel()
achieved = batch.next_observations["achieved_goal"].numpy()
desired = batch.next_observations["desired_goal"].numpy()
near = np.linalg.norm(achieved - desired, axis=1) <= 0.05
assert np.array_equal(rewards == 0.0, near), "rewards follow from relabelled goals"
print(f"wbc_suite {wbc_suite.__version__}: {near.mean():.0%} of a batch reach a goal")
