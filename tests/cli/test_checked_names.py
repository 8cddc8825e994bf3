"""Wrong names are told before any work starts; own benchmarks work by their place."""

import json
import sys

import pytest

NOTHING = "No {} named '{}'. Did you mean '{}'"


@pytest.fixture(autouse=True)
def folder(monkeypatch, tmp_path):
    """An empty folder, from which modules are imported."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])


BENCHMARK = NOTHING.format("benchmark", "Lif", "Lift")
ROBOT = NOTHING.format("robot", "Pandda", "Panda")
OPTIONS = {
    ("--robots", "Pandda"): ROBOT,
    ("--controller", "OSC_POS"): "Did you mean 'OSC_POSE'",
}


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        *((words, BENCHMARK) for words in ("evaluate Lif", "evaluate Lift Lif")),
        *((words, BENCHMARK) for words in ("expert Lif", "bench Lif", "teleop Lif")),
        ("record Lif -o a.hdf5", BENCHMARK),
        ("record Lif -o a.hdf5 --device keyboard", BENCHMARK),
        *(
            (f"{words} {option} {value}", told)
            for words in ("evaluate Lift", "record Lift -o a", "expert Lift")
            for (option, value), told in OPTIONS.items()
        ),
        ("bench --controller OSC_POS", "Did you mean 'OSC_POSE'"),
        ("teleop --controller WHOLE_BODY_IKK", "Did you mean 'WHOLE_BODY_IK'"),
        ("teleop --gripper PandaGriper --robots Panda", "gripper named 'PandaGriper'"),
        ("evaluate Lift --robots Panda,Pandda", ROBOT),
        ("evaluate Lift --policy exprt", NOTHING.format("policy", "exprt", "expert")),
        ("evaluate Lift --policy none.hdf5", "there is no such file"),
        ("evaluate no_such_module:Task", "no_such_module:Task' cannot be found"),
        ("record -o a --device keybord", "device named 'keybord'. Did you mean 'key"),
        ("serve-policy exprt", NOTHING.format("policy", "exprt", "expert")),
        ("evaluate Lift --executor proces", "executor named 'proces'. Did you mean"),
    ],
)
def test_a_wrong_name_is_told_before_work_starts(command, tmp_path, arguments, told):
    code, out, err = command(*arguments.split())
    assert (code, out) == (2, "")
    assert told in err
    assert "Traceback" not in err
    assert not list(tmp_path.iterdir()), "nothing is written"


OWN = """
from wbc_suite.benchmark import Lift
from wbc_suite.catalogue import Catalogue


class Mine(Lift):
    def __init__(self):
        super().__init__(Catalogue().find("tasks", "lift", kind="benchmark"))
        self.name = "Mine"
"""


@pytest.mark.slow
@pytest.mark.parametrize("executor", ["serial", "process"])
def test_a_benchmark_of_ones_own_is_evaluated_by_its_place(command, tmp_path, executor):
    (tmp_path / "own_bench.py").write_text(OWN)
    arguments = ["--episodes", 2, "--horizon", 2, "--policy", "hold", "--json"]
    arguments += ["--executor", executor, "--chunk", 1, "-o", tmp_path / "out"]
    code, out, err = command("evaluate", "own_bench:Mine", *arguments)
    assert code == 0, err
    assert json.loads(out)["cases"][0]["benchmark"] == "own_bench:Mine"
    assert json.loads(out)["episodes"] == 2
    del sys.modules["own_bench"]


@pytest.mark.slow
def test_a_catalogue_of_ones_own_is_evaluated(command, tmp_path, monkeypatch):
    monkeypatch.setenv("WBC_SUITE_CATALOGUE", "")
    (tmp_path / "tasks").mkdir()
    (tmp_path / "tasks" / "high.toml").write_text(
        'extends = "lift"\nname = "HighLift"\n[reward]\nlift_height = 0.1\n'
    )
    arguments = ["--episodes", 1, "--horizon", 2, "--policy", "hold", "--json"]
    arguments += ["-o", tmp_path / "out", "--catalogue", tmp_path]
    code, out, err = command("evaluate", "HighLift", *arguments)
    assert code == 0, err
    assert json.loads(out)["episodes"] == 1
    code, out, err = command("check", tmp_path / "tasks" / "high.toml")
    assert "Benchmark 'HighLift'" in out, err
