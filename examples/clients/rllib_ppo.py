"""PPO of RLlib on Lift, with the environments in a runner's process.

Install: pip install -e . -r examples/clients/rllib_ppo.txt
Shows:   a registered environment, its checks, training, and a restored checkpoint.
"""

import sys
import tempfile
from typing import Any

import ray
from ray.rllib.algorithms.ppo import PPO, PPOConfig
from ray.tune.registry import register_env

import wbc_suite
from wbc_suite.wrappers import Flat

iterations = int(sys.argv[1]) if len(sys.argv) > 1 else 1


def make(arguments: dict[str, Any]) -> Flat:
    """Make one environment with flat spaces."""
    return Flat(wbc_suite.make("Lift", **arguments))


ray.init(num_cpus=2, include_dashboard=False)
register_env("lift", make)
config = (
    PPOConfig()
    .environment("lift", env_config={"reward_shaping": True, "horizon": 50})
    .env_runners(num_env_runners=1, num_envs_per_env_runner=2)
    .training(train_batch_size=200, minibatch_size=50, num_epochs=2)
)
algorithm = config.build_algo()
for _ in range(iterations):
    result = algorithm.train()
found = result["env_runners"]
assert found["num_env_steps_sampled"] >= 200
assert found["episode_len_mean"] == 50
saved = algorithm.save_to_path(tempfile.mkdtemp())
algorithm.stop()
again = PPO.from_checkpoint(saved)
assert again.training_iteration == iterations
again.stop()
mean = found["episode_return_mean"]
print(f"wbc_suite {wbc_suite.__version__}, Ray {ray.__version__}: return {mean:.2f}")
