"""LeRobot's ACT on a recording of ours, rolled out by LeRobot's own evaluation.

Install: pip install -e . -r examples/clients/lerobot_act.txt
Shows:   `wbc-suite convert --to lerobot`, `lerobot_train.train`, and `eval_policy_all`
         of `lerobot-eval` on `wbc_suite.compat.lerobot.make_env`.
Usage:   lerobot_act.py [recording.hdf5 [steps]]; by default a smoke test.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

os.environ.setdefault("HF_HUB_OFFLINE", "1")

from lerobot.configs.default import DatasetConfig, EvalConfig
from lerobot.configs.train import TrainPipelineConfig
from lerobot.configs.types import NormalizationMode
from lerobot.optim.optimizers import AdamWConfig
from lerobot.optim.schedulers import DiffuserSchedulerConfig
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.policies.factory import make_pre_post_processors
from lerobot.processor import PolicyProcessorPipeline
from lerobot.scripts.lerobot_eval import eval_policy_all
from lerobot.scripts.lerobot_train import train

import wbc_suite
from wbc_suite.compat.lerobot import make_env
from wbc_suite.recording.converting import convert

folder = Path(tempfile.mkdtemp())
steps = int(sys.argv[2]) if len(sys.argv) > 2 else 5
smoke = steps < 1000
if len(sys.argv) > 1:
    recording = Path(sys.argv[1])
else:
    recording = folder / "lift.hdf5"
    record = ["record", "Lift", "--device", "expert", "--episodes", "3"]
    command = [sys.executable, "-m", "wbc_suite.cli", *record, "--out", str(recording)]
    subprocess.run(command, check=True)
data = convert(recording, folder / "lift", "lerobot")

width = 64 if smoke else 128
policy_config = ACTConfig(
    device="cpu",
    push_to_hub=False,
    chunk_size=16,
    n_action_steps=4,
    dim_model=width,
    n_heads=4,
    dim_feedforward=4 * width,
    use_vae=False,  # a third of the time of a step
    # The default leaves "ENV" out: objects in metres, all within a few centimetres.
    normalization_mapping=dict.fromkeys(
        ("STATE", "ENV", "ACTION"), NormalizationMode.MEAN_STD
    ),
)
config = TrainPipelineConfig(
    dataset=DatasetConfig(repo_id="lift", root=str(data)),
    policy=policy_config,
    output_dir=folder / "act",
    steps=steps,
    use_policy_training_preset=False,  # it does not lower the rate of learning
    optimizer=AdamWConfig(lr=3e-4, weight_decay=1e-4),
    scheduler=DiffuserSchedulerConfig(name="cosine", num_warmup_steps=0),
    batch_size=8 if smoke else 64,
    num_workers=0,
    eval_freq=0,
    save_freq=steps,
    eval=EvalConfig(n_episodes=1, batch_size=1),
)
train(config)

checkpoint = folder / "act" / "checkpoints" / "last" / "pretrained_model"
policy = ACTPolicy.from_pretrained(checkpoint)
before, after = make_pre_post_processors(policy.config, str(checkpoint))
episodes, horizon = (2, 20) if smoke else (200, 200)
info = eval_policy_all(
    make_env(2, cfg=SimpleNamespace(task="Lift"), robots="Panda", horizon=horizon),
    policy,
    env_preprocessor=PolicyProcessorPipeline(steps=[]),
    env_postprocessor=PolicyProcessorPipeline(steps=[]),
    preprocessor=before,
    postprocessor=after,
    n_episodes=episodes,
    start_seed=1000,
)
assert info["overall"]["n_episodes"] == episodes
print(f"wbc_suite {wbc_suite.__version__}: {info['overall']}")
