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
EXPRESSIONS = expressions.EXPRESSIONS

CLOSE = 1e-6
"""Greatest difference of numbers of equal expressions."""

OTHER_ORDER = {  # objects come before robots here
    "env.sim.get_state().flatten()",
    "env.sim.model.get_joint_qpos_addr('cube_joint0')",
    "env.sim.model.get_joint_qvel_addr('cube_joint0')",
    "env.sim.model.get_joint_qpos_addr('robot0_joint1')",
    "env.sim.model.body_name2id('cube_main')",
    "env.sim.model.joint_name2id('robot0_joint1')",
    "env.sim.model.camera_name2id('agentview')",
    "env.sim.data.get_site_jacp('gripper0_right_grip_site')",
    "env.robots[0].joint_indexes",
    "env.cube_body_id",
    "env.sim.model.geom_name2id('cube_g0_vis')",
}
OTHER_MODEL = {  # bodies, convex parts of links, and one motor for both fingers
    "env.sim.model.get_xml()",
    "env.sim.model.body_names",
    "env.sim.model.nu",
    "env.robots[0].robot_model.contact_geoms",
    "env.robots[0].gripper['right'].contact_geoms",
    "env.robots[0].gripper['right'].important_geoms['right_finger']",
}
FINGERS = {  # which move otherwise by that motor: their greatest differences
    "env._get_observations()['robot0_gripper_qpos']": 6e-4,  # m
    "env.robots[0].ee_force": 7e-4,  # N
    "env.robots[0].ee_torque": 7e-5,  # N m
    "env.robots[0].part_controllers['right'].torques": 6e-5,  # N m
    "env.observation_spec()": 2e-3,  # m/s of the fingers
}
DIFFERENT = OTHER_ORDER | OTHER_MODEL | FINGERS.keys()
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
    """Whether two values are equal, numbers to a tolerance."""
    if isinstance(one, int | float) and isinstance(other, int | float):
        return abs(one - other) <= tolerance + 1e-12
    return one == other


@pytest.mark.slow
@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_expression_has_a_value(ours, expression):
    kind, value = ours[expression]
    assert kind != "error", value


@pytest.mark.sample(45)
@pytest.mark.peer
@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_expression_is_as_in_robosuite(ours, theirs, expression):
    (kind, value), (their_kind, their_value) = ours[expression], theirs[expression]
    assert their_kind != "error", their_value
    if "flatten" not in expression:  # models have other numbers of joints
        assert kind == their_kind
    if expression in OTHER_ORDER | OTHER_MODEL:
        return
    pairs = list(zip(leaves(their_value), leaves(value), strict=True))
    tolerance = FINGERS.get(expression, CLOSE)
    assert all(agree(a, b, tolerance) for a, b in pairs), pairs


def test_no_more_than_these_differ(ours, theirs):
    found = {
        expression
        for expression in EXPRESSIONS
        for one, other in [(leaves(theirs[expression][1]), leaves(ours[expression][1]))]
        if len(one) != len(other)
        or not all(agree(a, b, CLOSE) for a, b in zip(one, other, strict=True))
    }
    assert found == DIFFERENT
    assert len(EXPRESSIONS) - len(DIFFERENT) >= 114
