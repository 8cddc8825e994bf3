"""Each client of `examples/clients/` runs unpatched, where its packages are."""

import ast
import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CLIENTS = sorted((ROOT / "examples" / "clients").glob("*.py"))
PEERS = ROOT / "benchmarks" / "peers"
SHARED = "".join(path.read_text() for path in PEERS.glob("clients*.txt"))
PATIENCE = 900.0  # s; torch takes minutes to be imported for the first time


def python_for(script: Path) -> str | None:
    """Return the client's own Python, the shared one, or this one if it has all."""
    own = ROOT / f".venv-client-{script.stem}/bin/python"
    shared = ROOT / ".venv-clients/bin/python"
    for python, has in ((own, True), (shared, script.stem in SHARED)):
        if has and python.exists():
            return str(python)
    modules = {
        name.partition(".")[0]
        for node in ast.walk(ast.parse(script.read_text()))
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else []
        )
    }
    found = all(importlib.util.find_spec(module) for module in modules)
    return sys.executable if found else None


def test_each_client_has_its_versions_and_says_how_to_install_them():
    assert CLIENTS
    for script in CLIENTS:
        pins = script.with_suffix(".txt").read_text().splitlines()
        assert pins
        assert all("==" in line for line in pins), script
        assert f"-r examples/clients/{script.stem}.txt" in script.read_text()


@pytest.mark.sample(2)
@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize("script", CLIENTS, ids=lambda path: path.stem)
def test_client_runs(script, tmp_path):
    python = python_for(script)
    if python is None:
        pytest.skip(f"not installed: make .venv-client-{script.stem}/.installed")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [python, str(script)],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        env=environment,
        cwd=tmp_path,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert "wbc_suite 0." in done.stdout
