"""TorchRL's GymEnv on an id, its checks, and a batch of parallel environments.

Install: pip install -e . -r examples/clients/torchrl_env.txt
Shows:   TensorDicts of observations by key, float64, and rollouts of two environments.
"""

import sys

import torch
from torchrl.envs import SerialEnv
from torchrl.envs.libs.gym import GymEnv
from torchrl.envs.utils import check_env_specs

import wbc_suite

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 20


def make() -> GymEnv:
    """Make one environment by its id."""
    return GymEnv("wbc_suite/Lift-v1", reward_shaping=True, horizon=steps)


env = make()
check_env_specs(env, seed=0)
rollout = env.rollout(steps)
assert rollout["cube_pos"].shape == (steps, 3)
assert rollout["next", "truncated"][-1].item()
torch.testing.assert_close(rollout["next", "cube_pos"][:-1], rollout["cube_pos"][1:])
both = SerialEnv(2, make).rollout(steps)
assert both["robot0_joint_pos"].shape[:2] == (2, steps)
reward = both["next", "reward"].mean()
print(f"wbc_suite {wbc_suite.__version__}: {both.batch_size}, reward {reward:.3f}")
