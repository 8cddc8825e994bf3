"""Each learning script trains, saves, goes on, and evaluates; SAC by both libraries."""

import json
import os
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPTS = ROOT / "examples" / "learning"
PYTHON = ROOT / ".venv-learning/bin/python"
CLONING = ("bc", "bc_history", "diffusion")
SMALL = ["save_every=20", "evaluate=1", "horizon=20", "width=32"]
SHORT = ["horizon=20", "learning_starts=40", "save_every=80", "log_every=40"]
SHORT += ["evaluate=1", "buffer=400", "layers=[16]"]


def run(name, *changes):
    if not PYTHON.exists():
        pytest.skip("torch is not installed: make .venv-learning/.installed")
    environment = os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{SCRIPTS}"}
    command = [PYTHON, SCRIPTS / f"{name}.py", *changes]
    return subprocess.check_output(command, text=True, env=environment, timeout=400)


@pytest.fixture(scope="module")
def demonstrations(tmp_path_factory):
    from typer.testing import CliRunner

    from wbc_suite.cli.app import app

    path = tmp_path_factory.mktemp("demos") / "lift.hdf5"
    command = ["record", "Lift", "--device", "expert", "--episodes", "2"]
    found = CliRunner().invoke(app, [*command, "--out", str(path)])
    assert found.exit_code == 0, found.output
    return path


def test_every_script_has_its_settings():
    scripts = {path.stem for path in SCRIPTS.glob("*.py")} - {"training", "imitation"}
    assert scripts == {path.stem for path in SCRIPTS.glob("*.toml")}
    assert scripts == {"sac", *CLONING}


@pytest.mark.parametrize("name", CLONING)
def test_cloning_asks_for_the_same_things(name):
    """Their curves can be compared: same data, observations and evaluation."""
    first, mine = (
        tomllib.loads((SCRIPTS / f"{n}.toml").read_text()) for n in ("bc", name)
    )
    same = ("demonstrations", "episodes", "observed", "benchmark", "horizon")
    assert {key: first[key] for key in same} == {key: mine[key] for key in same}


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


@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize("library", ["sbx", "sb3"])
def test_sac_trains_goes_on_and_is_evaluated(library, tmp_path):
    changes = [f'folder="{tmp_path}"', f'library="{library}"', *SHORT]
    assert "1 episodes" in run("sac", *changes, "steps=160")
    run("sac", *changes, "steps=240")
    assert (tmp_path / "sac_240_steps.zip").exists()
    steps = [json.loads(line)["step"] for line in (tmp_path / "curve.jsonl").open()]
    assert steps == sorted(set(steps))
    assert steps[-1] > 160
