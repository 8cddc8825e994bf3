"""Damaged files through the commands that read them; `sweep.py` reads many more."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SWEEP = Path(__file__).with_name("sweep.py")
FEW = "--texts 17 --recordings 9 --meshes 10 --commands 1"
"""A file of each kind."""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="The sweep counts as Linux does.")
def test_a_damaged_file_ends_no_command_in_a_traceback(tmp_path):
    found = tmp_path / "found.json"
    command = [sys.executable, SWEEP, *FEW.split(), "--json", found]
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    ended = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    rows = [json.loads(line) for line in found.read_text().splitlines()]
    assert len({row["number"] for row in rows}) == 36
    assert {row["code"] for row in rows} >= {0, 2}  # some are read, some are refused
