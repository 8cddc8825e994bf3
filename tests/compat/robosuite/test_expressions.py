"""The expressions that users write, here and beside robosuite; see `expressions`."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).with_name("expressions.py")
PEER = Path(__file__).parents[3] / ".venv-robosuite" / "bin" / "python"

_spec = importlib.util.spec_from_file_location("expressions", HERE)
expressions = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(expressions)
EXPRESSIONS = dict(expressions.EXPRESSIONS)

DIFFERENT = {
    # both fingers count from the closed hand here; robosuite's right one is negative
    "env._get_observations()['robot0_gripper_qpos']",
}
"""Expressions of which the values differ; `docs/from_robosuite.md` says why."""


def run(python, *arguments, **environment):
    """Return what the script found with an interpreter."""
    done = subprocess.run(
        [str(python), str(HERE), *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )
    lines = [x for x in done.stdout.splitlines() if x.startswith("FOUND")]
    assert lines, done.stderr[-2000:]
    return json.loads(lines[0].removeprefix("FOUND"))


@pytest.fixture(scope="module")
def ours():
    return run(sys.executable, "--here")


@pytest.fixture(scope="module")
def theirs():
    if not PEER.exists():
        pytest.skip("there is no .venv-robosuite")
    return run(PEER, PYTHONPATH="")


def leaves(value):
    """Return all single values of a nested one, dictionaries by their keys."""
    if isinstance(value, dict):
        return [x for key in sorted(value) for x in leaves(value[key])]
    if isinstance(value, list):
        return [x for item in value for x in leaves(item)]
    return [value]


def agree(one, other, tolerance):
    if isinstance(one, int | float) and isinstance(other, int | float):
        return abs(one - other) <= tolerance + 1e-12
    return one == other


@pytest.mark.slow
@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_expression_has_a_value(ours, expression):
    kind, value = ours[expression]
    assert kind != "error", value


@pytest.mark.peer
@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_expression_is_as_in_robosuite(ours, theirs, expression):
    (kind, value), (their_kind, their_value) = ours[expression], theirs[expression]
    assert their_kind != "error", their_value
    if "flatten" not in expression:  # models have other numbers of joints
        assert kind == their_kind
    tolerance = EXPRESSIONS[expression]
    if tolerance is None or expression in DIFFERENT:
        return
    pairs = list(zip(leaves(their_value), leaves(value), strict=True))
    assert all(agree(a, b, tolerance) for a, b in pairs), pairs


def test_at_most_four_expressions_differ():
    assert len(DIFFERENT) <= 4 <= len(EXPRESSIONS) - 88
