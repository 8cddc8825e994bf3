"""Every script in `examples/` runs as a newcomer would run it."""

import json
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

SAID = ("once on this machine", "has no compiled kernel")
"""What examples may say: the first one compiles, and one has a task in Python."""
FOLDER = Path(__file__).parents[1] / "examples"
NOTEBOOKS = sorted((FOLDER / "notebooks").glob("*.ipynb"))
EXAMPLES = sorted(FOLDER.glob("*.py"))


def test_examples_are_numbered_without_a_gap():
    numbers = [int(path.name.split("_")[0]) for path in EXAMPLES]
    assert numbers == list(range(1, len(EXAMPLES) + 1))


VIEWED = ("02_qp_stack", "03_whole_body_ik", "06_many_environments")


@pytest.mark.slow
@pytest.mark.parametrize("name", VIEWED)
def test_example_serves_what_it_shows(name):
    """Its address is logged; the page answers while it waits for somebody."""
    (path,) = [path for path in EXAMPLES if path.stem == name]
    command = [sys.executable, "-u", str(path), "--view"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as process:
        try:
            assert process.stdin is not None
            assert process.stdout is not None
            assert process.stderr is not None
            lines = (line.decode() for line in process.stderr)
            said = next(line for line in lines if "View the scene at" in line)
            address = said.split()[-1]
            with urllib.request.urlopen(address, timeout=60) as answer:
                assert b"<html" in answer.read()
            process.stdin.write(b"\n")
            process.stdin.close()
            assert process.stdout.read().count(b"\n") >= 2
            assert process.wait(300) == 0
        finally:
            process.kill()


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_from_its_first_cell_to_its_last(path, tmp_path):
    notebook = json.loads(path.read_text())
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert sum("image/png" in output.get("data", ()) for output in outputs) == 3
    assert all(cell["outputs"] for cell in cells)
    assert not [o for o in outputs if o["output_type"] == "error"]
    code = "\n\n".join("".join(cell["source"]) for cell in cells)
    result = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=300,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert "lifted: True" in result.stdout
    assert "the same bits: True" in result.stdout


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
    said = [
        line
        for line in result.stderr.splitlines()
        if not any(text in line for text in SAID)
    ]
    assert (result.returncode, said) == (0, [])
    assert result.stdout.count("\n") >= 2
    assert "nan" not in result.stdout.split()
    assert list(tmp_path.iterdir()) == []
