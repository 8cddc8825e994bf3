"""Tianshou's collector and SAC on environments of ours.

Install: pip install -e . -r examples/clients/tianshou_policy.txt
Shows:   `Flat` environments in a `DummyVectorEnv`, a collector, a few updates.
"""

import sys

import torch
from tianshou.algorithm import SAC
from tianshou.algorithm.modelfree.sac import SACPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv
from tianshou.utils.net.common import Net
from tianshou.utils.net.continuous import ContinuousActorProbabilistic, ContinuousCritic
from tianshou.utils.torch_utils import policy_within_training_step

import wbc_suite
from wbc_suite.wrappers import Flat

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 100
torch.set_num_threads(1)


def make() -> Flat:
    """Make one environment with flat spaces."""
    return Flat(wbc_suite.make("Lift", reward_shaping=True, horizon=50))


envs = DummyVectorEnv([make, make])
seen, acted = make().observation_space, make().action_space
size, actions = seen.shape, acted.shape
body = Net(state_shape=size, hidden_sizes=[64])
actor = ContinuousActorProbabilistic(
    preprocess_net=body, action_shape=actions, unbounded=True, conditioned_sigma=True
)
both = Net(state_shape=size, action_shape=actions, hidden_sizes=[64], concat=True)
algorithm = SAC(
    policy=SACPolicy(actor=actor, action_space=acted),
    policy_optim=AdamOptimizerFactory(lr=3e-4),
    critic=ContinuousCritic(preprocess_net=both),
    critic_optim=AdamOptimizerFactory(lr=3e-4),
)
collector = Collector(algorithm, envs, VectorReplayBuffer(1000, 2))
collector.reset()
found = collector.collect(n_step=steps)
assert found.n_collected_steps >= steps
with policy_within_training_step(algorithm.policy):
    policy_training = [
        algorithm.update(sample_size=32, buffer=collector.buffer) for _ in range(5)
    ]
loss = policy_training[-1].get_loss_stats_dict()
print(f"wbc_suite {wbc_suite.__version__}: {found.n_collected_steps} steps, {loss}")
