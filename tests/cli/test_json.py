"""`--json`: what commands print for programs; and completion of shells."""

import json
import subprocess
import sys

import pytest

from wbc_suite.catalogue import Catalogue
from wbc_suite.cli import main

LIFT = next(file for file in Catalogue().files("tasks") if file.stem == "lift")


def printed(arguments, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["wbc-suite", *arguments, "--json"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    return json.loads(capsys.readouterr().out)


def test_list(monkeypatch, capsys):
    found = printed(["list", "benchmarks"], monkeypatch, capsys)
    assert list(found) == ["benchmarks"]
    assert "Lift" in [row["name"] for row in found["benchmarks"]]


@pytest.mark.slow
def test_robots_are_listed_with_and_without_their_base(monkeypatch, capsys):
    found = printed(["list", "robots"], monkeypatch, capsys)["robots"]
    robots = {row["name"]: row for row in found}
    panda, mobile = robots["Panda"], robots["PandaOmron"]
    assert panda["kg"] == panda["bare kg"] == mobile["bare kg"]
    assert 15 < panda["kg"] < 20  # Franka: 18 kg with its hand, and no pedestal
    assert 2 < robots["Arx5"]["kg"] < 5  # ARX: 3.35 kg without a gripper
    assert mobile["kg"] > 90  # its base drives
    assert (mobile["dof"], mobile["bare dof"]) == (9, 8)
    assert robots["GR1"]["kg"] == robots["GR1"]["bare kg"]
    assert all(row["kg"] < 300 and isinstance(row["dof"], int) for row in found)


def test_masses_are_numbers(monkeypatch, capsys):
    found = printed(["list", "bases"], monkeypatch, capsys)["bases"]
    (mount,) = (row for row in found if row["name"] == "RethinkMount")
    assert mount["kg"] > 250  # of steel


def test_check(monkeypatch, capsys):
    found = printed(["check", str(LIFT)], monkeypatch, capsys)
    assert found["fine"]
    assert "Lift" in found["summary"]


@pytest.mark.slow
def test_doctor(monkeypatch, capsys):
    found = printed(["doctor"], monkeypatch, capsys)
    assert {"topic", "text", "state", "cure"} == set(found[0])


@pytest.mark.slow
def test_describe_action(monkeypatch, capsys):
    found = printed(["describe-action", "Panda"], monkeypatch, capsys)
    arm = found["slices"][0]
    assert len(arm["low"]) == len(arm["high"]) == len(arm["labels"]) == len(arm["hold"])


@pytest.mark.slow
@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_complete_commands(shell):
    variable = {"bash": "complete_bash", "zsh": "complete_zsh", "fish": "complete_fish"}
    words = {"COMP_WORDS": "wbc-suite desc", "COMP_CWORD": "1"}
    words |= {
        "_TYPER_COMPLETE_ARGS": "wbc-suite desc",
        "_TYPER_COMPLETE_FISH_ACTION": "",
    }
    words["_TYPER_COMPLETE_FISH_ACTION"] = "get-args"
    code = (
        "import sys; sys.argv = ['wbc-suite']; from wbc_suite.cli import main; main()"
    )
    result = subprocess.run(
        [sys.executable, "-c", code],
        env={"PATH": "", "PYTHONPATH": ":".join(sys.path)}
        | words
        | {"_WBC_SUITE_COMPLETE": variable[shell]},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "describe-action" in result.stdout, result.stderr
