"""Each learning script trains, saves, goes on, and evaluates; SAC by both libraries."""

import json
import os
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPTS = ROOT / "examples" / "learning"
ENVIRONMENTS = (ROOT / f".venv-{n}/bin/python" for n in ("learning", "clients"))
PYTHON = next((python for python in ENVIRONMENTS if python.exists()), None)
CLONING = ("bc", "bc_history", "diffusion")
SMALL = ["save_every=20", "evaluate=1", "horizon=20", "width=32"]
SHORT = ["horizon=20", "learning_starts=40", "save_every=80", "log_every=40"]
SHORT += ["evaluate=1", "buffer=400", "layers=[16]", "envs=2", "noise=0.5"]


def python(*arguments):
    if PYTHON is None:
        pytest.skip("torch is not installed: make .venv-learning/.installed")
    paths = f"{ROOT}{os.pathsep}{SCRIPTS}"
    environment = os.environ | {"PYTHONPATH": paths, "OMP_NUM_THREADS": "1"}
    command = [PYTHON, *arguments]
    return subprocess.check_output(command, text=True, env=environment, timeout=400)


def run(name, *changes):
    return python(SCRIPTS / f"{name}.py", *changes)


@pytest.fixture(scope="module")
def demonstrations(tmp_path_factory):
    from typer.testing import CliRunner

    from wbc_suite.cli.app import app

    path = tmp_path_factory.mktemp("demos") / "lift.hdf5"
    command = ["record", "Lift", "--device", "expert", "--episodes", "2"]
    found = CliRunner().invoke(app, [*command, "--out", str(path)])
    assert found.exit_code == 0, found.output
    return path


TRUTH = """
import numpy as np, torch
from imitation import Demonstrations, observe
from scipy.spatial.transform import Rotation

turns = Rotation.random(50, rng=0)
quats = turns.as_quat() * np.where(np.arange(50) % 2, 1.0, -1.0)[:, None]
seen = observe({"a_quat": quats, "b_pos": np.zeros((50, 3))}, ["a_quat", "b_pos"])
first_two = turns.as_matrix()[:, :, :2].transpose(0, 2, 1).reshape(50, 6)
assert np.allclose(seen[:, :6], first_two) and seen.shape == (50, 9)

data = Demonstrations.__new__(Demonstrations)
data.observations = [torch.arange(4.0)[:, None], torch.arange(10.0, 12.0)[:, None]]
data.actions = [torch.arange(4.0)[:, None], torch.arange(10.0, 12.0)[:, None]]
seen, acted = (each[:, :, 0].tolist() for each in data.windows(2, 3))
assert seen == [[0, 0], [0, 1], [1, 2], [2, 3], [10, 10], [10, 11]]
assert acted == [[0, 1, 2], [1, 2, 3], [2, 3, 3], [3, 3, 3], [10, 11, 11], [11, 11, 11]]
"""


@pytest.mark.peer
@pytest.mark.slow
def test_orientations_are_columns_and_windows_stay_in_their_episode():
    python("-c", TRUTH)


HOSTILE = """
import pathlib, pickle, sys
import numpy as np, torch
import imitation, training
from sac_checkpoints import read_buffer, write_buffer
from stable_baselines3.common.buffers import ReplayBuffer
from gymnasium.spaces import Box

class Evil:
    def __reduce__(self):
        return pathlib.Path.touch, (folder / "executed",)

folder = pathlib.Path(sys.argv[1])
path = folder / "checkpoint_00000020.pt"

def refused(read, *arguments):
    try:
        read(*arguments)
    except SystemExit as reason:
        return str(reason)
    raise AssertionError("was read")

settings = training.Settings(folder=str(folder), keep=1)
whole = dict.fromkeys(imitation.SAVED, 0)
for content in (Evil(), whole | {"model": Evil()}, {"step": np.zeros(3)}):
    torch.save(content, path)
    assert "holds objects besides tensors" in refused(training.Run(settings).resume)
    policy = imitation.last_policy(None, str(folder))
    assert str(path) in refused(policy, None, None)
torch.save(whole | {"model": torch.ones(2)}, path)
for size in range(0, path.stat().st_size, 50):
    path.with_name("checkpoint_00000030.pt").write_bytes(path.read_bytes()[:size])
    assert "damaged" in refused(training.Run(settings).resume)
path.with_name("checkpoint_00000030.pt").unlink()
torch.save({"step": 1}, path)
assert "no model" in refused(training.Run(settings).resume)

box, path = Box(-1.0, 1.0, (3,), np.float32), folder / "buffer.npz"
buffer, other = (ReplayBuffer(n, box, box, "cpu", n_envs=2) for n in (8, 12))
rng = np.random.default_rng(0)
def add(buffer, n):
    for _ in range(n):
        a, b, c = rng.uniform(-1.0, 1.0, (3, 2, 3))
        buffer.add(a, b, c, np.array([1.0, 2.0]), np.array([0, 1]), [{}, {}])
for n in (3, 3):  # rows; partly filled, then full and begun again
    add(buffer, n)
    write_buffer(path, buffer)
    again = ReplayBuffer(8, box, box, "cpu", n_envs=2)
    read_buffer(path, again)
    assert (again.pos, again.full) == (buffer.pos, buffer.full)
    for name in ("observations", "next_observations", "actions", "rewards", "dones"):
        np.testing.assert_array_equal(getattr(again, name), getattr(buffer, name))
assert "another size" in refused(read_buffer, path, other)
arrays = dict(np.load(path))
for changes in ({"rewards": np.array([Evil()])}, {"next": np.array(9)}, {"dones": 0}):
    np.savez(path, allow_pickle=True, **(arrays | changes))
    refused(read_buffer, path, again)
path.write_bytes(pickle.dumps(Evil()))
assert "no replay buffer" in refused(read_buffer, path, again)
assert not (folder / "executed").exists()
"""


@pytest.mark.peer
@pytest.mark.slow
def test_checkpoints_and_buffers_of_others_are_refused_and_not_executed(tmp_path):
    python("-c", HOSTILE, tmp_path)


KEPT = """
import sys
from pathlib import Path
import gymnasium, numpy as np
from sac_checkpoints import parameters, resume, restore, write_buffer, buffer_of
from training import write_checkpoint

def model(width):
    if sys.argv[1] == "sbx":
        from sbx import SAC
    else:
        from stable_baselines3 import SAC
    return SAC("MlpPolicy", gymnasium.make("Pendulum-v1"), learning_starts=10, seed=0,
        buffer_size=100, policy_kwargs={"net_arch": [width]})

first, path = model(8), Path(sys.argv[2]) / "sac_40_steps.pt"
first.learn(40)
write_buffer(buffer_of(path), first.replay_buffer)
write_checkpoint(path, parameters(first))
again = model(8)
seen = np.random.default_rng(0).uniform(-1.0, 1.0, (5, 3)).astype(np.float32)
acts = lambda each: each.predict(seen, deterministic=True)[0]
assert not np.allclose(acts(again), acts(first))
resume(again, path.parent)
np.testing.assert_array_equal(acts(again), acts(first))
assert (again.num_timesteps, again.replay_buffer.pos) == (40, 40)
one, two = parameters(first), parameters(again)
flat = lambda x: [y for v in (x.values() if isinstance(x, dict) else x) for y in
    (flat(v) if isinstance(v, (dict, list)) else [v])]
for a, b in zip(flat(one), flat(two), strict=True):
    np.testing.assert_array_equal(np.asarray(a), np.asarray(b))
try:
    resume(model(9), path.parent)
except SystemExit as reason:
    assert "network" in str(reason), reason
else:
    raise AssertionError("other networks were accepted")
"""


@pytest.mark.sweep
@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize("library", ["sbx", "sb3"])
def test_a_resumed_model_is_the_saved_one(library, tmp_path):
    """Parameters, optimisers, entropy, random state, replay buffer and steps."""
    python("-c", KEPT, library, tmp_path)


def test_every_script_has_its_settings():
    shared = {"training", "imitation", "sac_checkpoints"}
    scripts = {path.stem for path in SCRIPTS.glob("*.py")} - shared
    assert scripts == {path.stem for path in SCRIPTS.glob("*.toml")}
    assert scripts == {"sac", *CLONING}


@pytest.mark.parametrize("name", CLONING)
def test_cloning_asks_for_the_same_things(name):
    """Their curves can be compared: same data and evaluation."""
    first, mine = (
        tomllib.loads((SCRIPTS / f"{n}.toml").read_text()) for n in ("bc", name)
    )
    same = ("demonstrations", "episodes", "benchmark", "horizon", "evaluate")
    assert {key: first[key] for key in same} == {key: mine[key] for key in same}


@pytest.mark.sample(1)
@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize("name", CLONING)
def test_cloning_trains_goes_on_and_is_evaluated(name, demonstrations, tmp_path):
    changes = [f'demonstrations="{demonstrations}"', f'folder="{tmp_path}"', *SMALL]
    first = run(name, *changes, "steps=40")
    assert "step 20:" in first
    assert "step 40:" in first
    second = run(name, *changes, "steps=60")
    assert "step 40:" not in second
    assert "mean of the last 3" in second
    rows = [json.loads(line) for line in (tmp_path / "log.jsonl").open()]
    losses = [row["loss"] for row in rows if "loss" in row]
    assert losses[-1] < losses[0]
    assert [row["step"] for row in rows if "success" in row][-3:] == [20, 40, 60]
    assert (tmp_path / "curves.png").stat().st_size > 1000
    assert list((tmp_path / "tensorboard").iterdir())


@pytest.mark.sweep
@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize("library", ["sbx", "sb3"])
def test_sac_trains_goes_on_and_is_evaluated(library, tmp_path):
    changes = [f'folder="{tmp_path}"', f'library="{library}"', *SHORT]
    assert "1 episodes" in run("sac", *changes, "steps=160")
    run("sac", *changes, "steps=240")
    assert (tmp_path / "sac_240_steps.pt").exists()
    steps = [json.loads(line)["step"] for line in (tmp_path / "curve.jsonl").open()]
    assert steps == sorted(set(steps))
    assert steps[-1] > 160
    whole, cut = (tmp_path / f"sac_replay_buffer_{n}_steps.npz" for n in (160, 240))
    assert set(tmp_path.glob("*.npz")) == {whole, cut}
    cut.write_bytes(cut.read_bytes()[:1000])
    assert f"'{cut}' is no replay buffer" in run("sac", *changes, "steps=320")
    lines = (tmp_path / "curve.jsonl").read_text().splitlines()
    assert json.loads(lines[len(steps)])["step"] <= 240  # goes on from 160
