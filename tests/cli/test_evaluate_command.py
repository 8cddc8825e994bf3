"""`wbc-suite evaluate` plays, compares, writes, and goes on where it stopped."""

import json
import re
import signal
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from wbc_suite.cli.app import app
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.evaluation import episode_seeds

SHORT = ["evaluate", "Lift", "--controller", "JOINT_POSITION", "--horizon", "4"]
SHORT += ["--executor", "serial"]


def seeds_in(folder):
    items = [json.loads(path.read_text()) for path in (folder / "results").iterdir()]
    return sorted(seed for item in items for seed in item["payload"]["seeds"])


@pytest.mark.slow
def test_command_plays_writes_and_goes_on(tmp_path):
    command = [*SHORT, "--episodes", "3", "--chunk", "2", "--policy", "hold"]
    command += ["-o", str(tmp_path)]
    first = CliRunner().invoke(app, command)
    assert first.exit_code == 0, first.output
    figures = json.loads((tmp_path / "summary.json").read_text())
    assert (figures["episodes"], figures["successes"]) == (3, 0)
    assert figures["cases"][0]["mean_steps"] == 4.0
    assert seeds_in(tmp_path) == sorted(episode_seeds("Lift", 3))
    info = json.loads((tmp_path / "eval_info.json").read_text())
    assert info["overall"]["n_episodes"] == 3
    assert "<h1>Evaluation</h1>" in (tmp_path / "report.html").read_text()
    stamps = {p: p.stat().st_mtime_ns for p in (tmp_path / "results").iterdir()}
    assert len(stamps) == 2
    assert CliRunner().invoke(app, command).exit_code == 0
    assert {p: p.stat().st_mtime_ns for p in stamps} == stamps


@pytest.mark.slow
def test_json_is_all_that_is_printed_and_policies_are_compared(tmp_path):
    command = [*SHORT, "--episodes", "2", "--json", "-o", str(tmp_path)]
    command += ["--policy", "hold", "--policy", "random", "--first-seed", "7"]
    found = CliRunner().invoke(app, command)
    figures = json.loads(found.stdout)
    assert (figures["episodes"], figures["successes"]) == (4, 0)
    assert figures["success_rate"] == 0.0
    assert {"wilson", "exact", "stratified"} < figures["intervals"].keys()
    assert [case["policy"] for case in figures["cases"]] == ["hold", "random"]
    assert figures["comparisons"][0]["pairs"] == 2
    assert seeds_in(tmp_path) == [7, 7, 8, 8]


@pytest.mark.slow
def test_perturbations_are_cases_beside_the_usual_one(tmp_path):
    command = [*SHORT, "--episodes", "1", "--json", "-o", str(tmp_path)]
    command += ["--policy", "hold", "--perturb", "none", "--perturb", "camera"]
    figures = json.loads(CliRunner().invoke(app, command).stdout)
    assert [case["perturb"] for case in figures["cases"]] == ["", "camera"]
    wrong = CliRunner().invoke(app, [*SHORT, "--perturb", "camra"])
    assert isinstance(wrong.exception, UnknownNameError)


@pytest.mark.slow
def test_failures_are_filmed_into_the_report(tmp_path):
    command = [*SHORT, "--episodes", "2", "--films", "1", "-o", str(tmp_path)]
    found = CliRunner().invoke(app, command)
    assert found.exit_code == 0, found.output
    (film,) = (tmp_path / "films").iterdir()
    assert film.read_bytes()[8:12] == b"WEBP"
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/webp;base64,") == 1


@pytest.mark.slow
def test_success_ends_an_episode_unless_asked_otherwise(tmp_path):
    command = ["evaluate", "Lift", "--policy", "expert", "--episodes", "1"]
    command += ["--horizon", "80", "--executor", "serial", "--json"]
    lengths = []
    for k, more in enumerate(([], ["--no-stop"])):
        found = CliRunner().invoke(app, [*command, *more, "-o", str(tmp_path / str(k))])
        figures = json.loads(found.stdout)
        assert figures["successes"] == 1
        lengths.append(figures["cases"][0]["mean_steps"])
    assert lengths[0] < lengths[1] == 80.0


def test_command_knows_at_once_that_a_controller_is_missing(tmp_path):
    command = ["evaluate", "Lift", "--controller", "NOTHING", "-o", str(tmp_path)]
    result = CliRunner().invoke(app, command)
    assert isinstance(result.exception, UnknownNameError)
    assert "NOTHING" in str(result.exception)
    assert list(tmp_path.iterdir()) == []


def test_command_says_what_failed(tmp_path, monkeypatch):
    def make_case(payload):
        raise ConfigError("no such table")

    monkeypatch.setattr("wbc_suite.evaluation.rollouts.make_case", make_case)
    command = ["evaluate", "Lift", "--executor", "serial", "--episodes", "3"]
    result = CliRunner().invoke(app, [*command, "-o", str(tmp_path)])
    assert result.exit_code == 1
    assert "no such table" in result.output
    assert "1 of 1 items failed" in result.output
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["episodes"], summary["cases"][0]["errors"]) == (
        3,
        {"work item failed": 3},
    )


@pytest.mark.slow
def test_command_knows_at_once_that_a_robot_is_missing(tmp_path):
    command = ["evaluate", "Lift", "--robots", "Panda,Panada", "-o", str(tmp_path)]
    result = CliRunner().invoke(app, command)
    assert isinstance(result.exception, UnknownNameError)
    assert list(tmp_path.iterdir()) == []


def test_robots_are_those_of_each_benchmark_by_default():
    from wbc_suite.cli.evaluate import _cases

    def robots(*given):
        names = ["Lift", "TwoArmLift"]
        cases = _cases(names, given, None, ["hold"], None, arguments={})
        return [case.robots for case in cases]

    assert robots() == [("Panda",), ("Panda", "Panda")]
    assert robots("UR5e", "Panda,Sawyer") == 2 * [("UR5e",), ("Panda", "Sawyer")]


@pytest.mark.slow
def test_a_served_policy_is_evaluated(tmp_path):
    words = [
        sys.executable,
        "-m",
        "wbc_suite.cli",
        "serve-policy",
        "hold",
        "--port",
        "0",
    ]
    server = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        address = re.search(r"socket://\S+", server.stdout.readline())
        assert address is not None
        command = [*SHORT, "--episodes", "1", "--policy", address[0], "--json"]
        found = CliRunner().invoke(app, [*command, "-o", str(tmp_path)])
        assert json.loads(found.stdout)["episodes"] == 1
    finally:
        server.send_signal(signal.SIGINT)
        assert server.wait(timeout=60) == 130
