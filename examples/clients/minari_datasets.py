"""Record with Minari's own collector, read it back, and replay its actions.

Install: pip install -e . -r examples/clients/minari_datasets.txt
Shows:   `DataCollector` around an environment, its id in the dataset, recovery from it.
         Own recordings become Minari datasets by `wbc-suite convert`.
"""

import os
import sys
import tempfile

import gymnasium
import numpy as np

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 20
os.environ["MINARI_DATASETS_PATH"] = tempfile.mkdtemp()

import minari  # noqa: E402 - reads the folder of datasets at once

import wbc_suite  # noqa: E402
from wbc_suite.evaluation import make_policy  # noqa: E402

env = minari.DataCollector(gymnasium.make("wbc_suite/Lift-v1", horizon=steps))
expert = make_policy("expert", env.unwrapped, 0)
seen, _ = env.reset(seed=0)
for _ in range(steps):
    seen, *_ = env.step(expert(seen).astype(np.float32))
env.create_dataset("lift/expert-v0")

dataset = minari.load_dataset("lift/expert-v0")
(episode,) = dataset
again = dataset.recover_environment()
again.reset(seed=0)
for action in episode.actions:
    seen, *_ = again.step(action)
assert np.array_equal(seen["cube_pos"], episode.observations["cube_pos"][-1])
print(f"wbc_suite {wbc_suite.__version__}: {len(episode)} steps replayed bit for bit")
