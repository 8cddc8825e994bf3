"""Names and texts of files reach the terminal without control characters."""

import ast
import sys
from pathlib import Path

import h5py
import pytest

import wbc_suite
from wbc_suite.catalogue import ENVIRONMENT_VARIABLE
from wbc_suite.cli import main, output

HOSTILE = "a\x1b[2J\x9b31m\x07"  # clears the screen, colours it and rings
SHOWN = r"a\x1b[2J\x9b31m\x07"


def said_by(monkeypatch, capfd, *arguments):
    """Run a command; return all that it wrote."""
    monkeypatch.setattr(sys, "argv", ["wbc-suite", *map(str, arguments)])
    with pytest.raises(SystemExit):
        main()
    said = "".join(capfd.readouterr())
    assert said.replace("\n", "").isprintable(), said
    return said


@pytest.mark.slow
def test_recordings_command_no_terminal(monkeypatch, capfd, tmp_path):
    path = tmp_path / "hostile.hdf5"
    with h5py.File(path, "w") as file:
        file[f"mask/{HOSTILE}"] = [f"demo_{HOSTILE}".encode()]
        data = file.create_group("data")
        data.attrs["date"] = data.attrs["versions"] = HOSTILE
        data.attrs["env_args"] = f'{{"env_name": "{HOSTILE[:1]}\\u001b[2J"}}'
        episode = data.create_group(f"demo_{HOSTILE}")
        episode.attrs["num_samples"] = 1
        episode["actions"] = [[0.0]]
        episode[HOSTILE] = [[0.0]]
    said = said_by(monkeypatch, capfd, "inspect", path, "--columns")
    assert SHOWN in said
    for command in ("verify", "replay"):
        said_by(monkeypatch, capfd, command, path)


def test_the_catalogue_commands_no_terminal(monkeypatch, capfd, tmp_path):
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, "")
    (tmp_path / "tasks").mkdir()
    title = HOSTILE.encode("unicode_escape").decode().replace("\\x", "\\u00")
    (tmp_path / "tasks/lift.toml").write_text(f'name = "Lift"\ntitle = "{title}"')
    extra = "--catalogue", tmp_path
    assert SHOWN in said_by(monkeypatch, capfd, "list", "benchmarks", *extra)


def test_every_command_prints_that_way():
    folder = Path(wbc_suite.__file__).parent / "cli"
    for path in sorted(set(folder.glob("*.py")) - {folder / "output.py"}):
        tree = ast.parse(path.read_text())
        names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        imported = "from wbc_suite.cli.output import print" in ast.unparse(tree)
        assert imported or "print" not in names, path


def test_print_is_as_pythons_otherwise(capsys):
    output.print("a", 1, None, end="!", file=sys.stderr)
    assert capsys.readouterr() == ("", "a 1 None!")
