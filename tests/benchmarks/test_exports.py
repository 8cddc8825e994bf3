"""Exported robots in readers that have an environment of their own."""

import json
from pathlib import Path

import exports
import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.sweep
@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize("reader", exports.SIDES)
def test_readers_place_a_robot_as_we_do(tmp_path, reader):
    python = exports.python_of(reader, ROOT)
    if python is None:
        pytest.skip(f"{reader} is not installed: make bench-peers")
    exports.write_case("h1_floating_body", tmp_path)  # planar root, closed loops
    row = exports.aside(reader, tmp_path, python)["h1_floating_body"]
    assert exports.agrees(row), json.dumps(row)


@pytest.mark.slow
def test_a_displaced_link_or_a_kilogram_would_be_noticed(tmp_path):
    robot, own = exports.write_case("panda", tmp_path)
    file, case = next((own / "pinocchio").glob("*.urdf")), tmp_path / "panda.npz"
    text = file.read_text(encoding="utf-8")
    assert exports.agrees(exports.in_pinocchio(robot, own / "pinocchio", case))
    moved = text.replace('xyz="0.0 -0.316 0.0"', 'xyz="0.0 -0.31601 0.0"')
    for wrong in (moved, text.replace('<mass value="3', '<mass value="4')):
        assert wrong != text
        file.write_text(wrong, encoding="utf-8")
        row = exports.in_pinocchio(robot, own / "pinocchio", case)
        assert not exports.agrees(row)
