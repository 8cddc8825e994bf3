"""Every script in `examples/` runs as a newcomer would run it."""

import subprocess
import sys
from pathlib import Path

import pytest

COMPILING = "once on this machine"  # the first run of all says what takes long
EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))


def test_examples_are_numbered_without_a_gap():
    numbers = [int(path.name.split("_")[0]) for path in EXAMPLES]
    assert numbers == list(range(1, len(EXAMPLES) + 1))


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs_quietly_and_leaves_nothing_behind(path, tmp_path):
    result = subprocess.run(
        [sys.executable, "-W", "error::RuntimeWarning", str(path)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=300,
    )
    said = [line for line in result.stderr.splitlines() if COMPILING not in line]
    assert (result.returncode, said) == (0, [])
    assert result.stdout.count("\n") >= 2
    assert "nan" not in result.stdout.split()
    assert list(tmp_path.iterdir()) == []
