"""Commands as a person types them."""

import sys
from pathlib import Path

import pytest

from wbc_suite.catalogue import ENVIRONMENT_VARIABLE
from wbc_suite.cli import main


@pytest.fixture
def command(monkeypatch, capsys):
    """Run a command as the shell would; give its exit code, output and errors."""
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, "")

    def run(*arguments: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["wbc-suite", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return int(ended.value.code or 0), out, err

    return run
