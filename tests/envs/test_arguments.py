"""`make` has typed arguments: those of the config, under the same names."""

import inspect
import subprocess
import sys
from pathlib import Path
from typing import get_type_hints

import pytest

import wbc_suite
from wbc_suite.envs import RobotEnv, VectorRobotEnv
from wbc_suite.envs.config import EnvArguments, EnvConfig

FIELDS = {*EnvConfig.model_fields, "has_renderer", "has_offscreen_renderer"}
"""The last two are those of the robosuite paper; they mean `render_mode`."""
ROOT = Path(__file__).parents[2]
CALLS = """
import wbc_suite
wbc_suite.make("Lift", robots=["Panda"], horizon=10, render_mode="rgb_array")
wbc_suite.make("Lift", horizon="ten")
wbc_suite.make("Lift", robot="Panda")
wbc_suite.make("Lift", render_preset="fastest")
"""


def test_typed_arguments_are_the_fields_of_the_config():
    assert set(EnvArguments.__annotations__) == FIELDS
    assert EnvArguments.__required_keys__ == frozenset()


@pytest.mark.parametrize("function", [wbc_suite.make, RobotEnv, VectorRobotEnv])
def test_all_ways_to_make_an_environment_take_them(function):
    last = [*inspect.signature(function).parameters.values()][-1]
    assert last.kind is inspect.Parameter.VAR_KEYWORD
    assert last.annotation.__args__ == (EnvArguments,)


def test_their_types_can_be_resolved():
    assert get_type_hints(EnvArguments).keys() == FIELDS


@pytest.mark.slow
def test_a_type_checker_finds_wrong_calls_and_only_those(tmp_path):
    pytest.importorskip("pyright")
    script = tmp_path / "calls.py"
    script.write_text(CALLS)
    (tmp_path / "pyrightconfig.json").write_text(
        f'{{"extraPaths": ["{ROOT}"], "venvPath": "{ROOT}", "venv": ".venv"}}'
    )
    command = [sys.executable, "-m", "pyright", "--project", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    errors = [line for line in done.stdout.splitlines() if "error:" in line]
    wrong = {line.split(":")[1] for line in errors}
    assert wrong == {"4", "5", "6"}, done.stdout
