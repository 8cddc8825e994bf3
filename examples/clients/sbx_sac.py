"""SAC of sbx (Stable-Baselines3 in JAX) on four environments of Lift.

Install: pip install -e . -r examples/clients/sbx_sac.txt
Shows:   Stable-Baselines3's vectors and checks with `Flat` spaces, save and load.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from sbx import SAC
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import wbc_suite
from wbc_suite.wrappers import Flat

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 200
arguments = {"reward_shaping": True, "horizon": 50}
check_env(Flat(wbc_suite.make("Lift", **arguments)), skip_render_check=True)
envs = make_vec_env(
    "wbc_suite/Lift-v1", 4, seed=0, env_kwargs=arguments, wrapper_class=Flat
)
model = SAC("MlpPolicy", envs, learning_starts=50, train_freq=8, seed=0)
model.learn(steps)
path = Path(tempfile.mkdtemp()) / "sac.zip"
model.save(path)
again = SAC.load(path, env=envs)
seen = envs.reset()
first, second = (each.predict(seen, deterministic=True)[0] for each in (model, again))
np.testing.assert_array_equal(first, second)
mean, _ = evaluate_policy(again, envs, n_eval_episodes=4)
assert 0.0 <= mean <= 50.0, "a shaped reward of a step is between 0 and 1"
print(
    f"wbc_suite {wbc_suite.__version__}: {model.num_timesteps} steps, return {mean:.2f}"
)
