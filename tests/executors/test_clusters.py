"""Ray and submitit do the same work, with the death of a worker in it."""

import json
import os
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PYTHON = ROOT / ".venv-cluster/bin/python"


@pytest.mark.sample(1)
@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize("name", ["ray", "slurm"])
def test_work_survives_the_death_of_a_worker(name, tmp_path):
    if not PYTHON.exists():
        pytest.skip("Ray and submitit are not installed: make bench-peers")
    paths = os.pathsep.join([str(ROOT), str(HERE)])
    found = tmp_path / "outcomes.json"
    command = [PYTHON, HERE / "cluster_run.py", name, tmp_path / "work", found]
    environment = {**os.environ, "PYTHONPATH": paths}
    subprocess.run(command, check=True, env=environment, timeout=300)
    outcomes = json.loads(found.read_text())
    lost = outcomes.pop("c")
    assert outcomes == {n: [2 * "abcdef".index(n), None] for n in "abdef"}
    assert lost[0] is None
    assert ("lost 2 times" if name == "ray" else "job failed") in lost[1]
