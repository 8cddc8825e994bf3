"""Wrong command lines: exit code 2 and words, never a traceback."""

import sys

import pytest

from wbc_suite.catalogue import ENVIRONMENT_VARIABLE
from wbc_suite.cli import main

FILES = {
    "bin.toml": b"\xff\xfe\x00\x01",
    "bad.toml": b"a = ",
    "empty.toml": b"",
    "name.toml": b"name = 3",
    "frame.toml": b"frame = 3",
    "bad.urdf": b"<robot>",
    "empty.urdf": b"",
    "bad.xml": b"<x/>",
    "note.txt": b"hello",
}
USAGE = [  # typer's own words: a usage line and a box
    "nonsense",
    "check",
    "export",
    "export Panda",
    "export Panda --to x",
    "render Panda",
    "render Panda -o x.png --width 1",
    "render Panda -o x.png --view up",
    "list nope",
    "list robots extra",
    "view Panda --port 99999",
    "teleop --rate 1",
    "teleop --rate nan",
    "teleop --rate 300",
    "teleop --seed a",
    "--nope",
]
WORDS = [  # ours: one line
    *(f"check {name}" for name in FILES),
    "check nope",
    "check nope.toml",
    "check /",
    "export nope --to urdf",
    "export Panda --to urdf -o /nope/x",
    "render nope -o x.png",
    "render Panda -o x.png --keyframe nope",
    "list --catalogue nope",
    "view nope",
    "view Panda --gripper nope",
    "view Panda --base nope",
    "teleop nope",
    "teleop Lift --robots nope",
    "teleop Lift --controller nope",
    "teleop Lift --controller nope.toml",
    "describe-action nope",
    "doctor x",
    "describe-action Panda --controller x",
]


def run(line, monkeypatch, capsys):
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, "")
    monkeypatch.setattr(sys, "argv", ["wbc-suite", *line.split()])
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code, capsys.readouterr().err


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, content in FILES.items():
        (tmp_path / name).write_bytes(content)


@pytest.mark.parametrize("line", USAGE)
def test_a_wrong_usage_shows_the_usage(line, folder, monkeypatch, capsys):
    code, err = run(line, monkeypatch, capsys)
    assert code == 2
    assert "Usage" in err
    assert "Traceback" not in err


@pytest.mark.parametrize("line", WORDS)
def test_a_wrong_name_or_file_gets_one_line(line, folder, monkeypatch, capsys):
    code, err = run(line, monkeypatch, capsys)
    assert code == 2
    assert err.startswith("wbc-suite: ")
    assert err.count("\n") == 1
