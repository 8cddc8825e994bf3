"""robomimic 0.3 or 0.5 as it is: BC-RNN on a recording, in robomimic's own evaluation.

Install: pip install -e . -r examples/clients/robomimic_bc_rnn.txt
         0.5 is not on PyPI: pip install git+https://github.com/ARISE-Initiative/robomimic
Shows:   `wbc-suite convert --to robomimic`, the alias of robosuite, `train`, and
         `rollout_with_stats` of the checkpoint that it wrote.
Usage:   robomimic_bc_rnn.py [recording.hdf5 [epochs]]; by default a smoke test.
"""

import subprocess
import sys
import tempfile
import types
from pathlib import Path

import wbc_suite
from wbc_suite.compat.robosuite.alias import install_alias
from wbc_suite.recording.converting import convert

install_alias()  # robomimic imports robosuite
try:
    import mujoco_py as _
except ImportError:  # robomimic 0.3 imports it too, for the type of one exception
    kind = type("MujocoException", (Exception,), {})
    sys.modules["mujoco_py"] = stand_in = types.ModuleType("mujoco_py")
    setattr(stand_in, "builder", types.SimpleNamespace(MujocoException=kind))  # noqa: B010

import robomimic  # noqa: E402
import torch  # noqa: E402
from robomimic.config import config_factory  # noqa: E402
from robomimic.scripts.train import train  # noqa: E402
from robomimic.utils.file_utils import env_from_checkpoint, policy_from_checkpoint  # noqa: E402
from robomimic.utils.train_utils import rollout_with_stats  # noqa: E402

OBSERVED = ["robot0_eef_pos", "robot0_eef_quat", "robot0_gripper_qpos", "object"]
folder = Path(tempfile.mkdtemp())
epochs = int(sys.argv[2]) if len(sys.argv) > 2 else 1
rollouts = 50 if epochs > 1 else 1
if len(sys.argv) > 1:
    recording = Path(sys.argv[1])
else:
    recording = folder / "lift.hdf5"
    record = ["record", "Lift", "--device", "expert", "--episodes", "3"]
    command = [sys.executable, "-m", "wbc_suite.cli", *record, "--out", str(recording)]
    subprocess.run(command, check=True)
data = convert(recording, folder / "robomimic.hdf5", "robomimic")

config = config_factory("bc")
with config.unlocked():
    config.experiment.name = "lift"
    config.experiment.epoch_every_n_steps = 100 if epochs > 1 else 5
    config.experiment.rollout.n, config.experiment.rollout.rate = rollouts, epochs
    config.experiment.rollout.horizon, config.experiment.rollout.warmstart = 200, 0
    config.experiment.save.every_n_epochs = epochs
    config.experiment.render_video = config.experiment.validate = False
    old = robomimic.__version__ < "0.4"
    config.train.data = str(data) if old else [{"path": str(data)}]
    config.train.output_dir, config.train.cuda = str(folder), torch.cuda.is_available()
    config.train.num_data_workers, config.train.num_epochs = 0, epochs
    config.train.batch_size, config.train.seq_length = 50, 10
    config.algo.rnn.enabled, config.algo.rnn.horizon = True, 10
    config.algo.actor_layer_dims, config.algo.gmm.enabled = (), False
    config.algo.rnn.hidden_dim = 100
    config.algo.optim_params.policy.learning_rate.initial = 1e-3
    config.observation.modalities.obs.low_dim = OBSERVED
device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
train(config, device=device)

(checkpoint,) = (folder / "lift").glob(f"*/models/model_epoch_{epochs}*.pth")
policy, saved = policy_from_checkpoint(ckpt_path=str(checkpoint), device=device)
env, _ = env_from_checkpoint(ckpt_dict=saved, render_offscreen=False)
stats, _ = rollout_with_stats(policy, {"Lift": env}, horizon=50, num_episodes=1)
assert stats["Lift"]["Horizon"] == 50 or stats["Lift"]["Success_Rate"] == 1.0
print(f"wbc_suite {wbc_suite.__version__}, robomimic {robomimic.__version__}: {stats}")
