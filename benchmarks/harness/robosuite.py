"""robosuite in its own environment, asked line by line, so that blocks alternate."""

import json
import os
import subprocess
from pathlib import Path
from typing import Any

__all__ = ["Robosuite"]

ROOT = Path(__file__).parent.parent.parent


class Robosuite:
    """A process that runs `peers/robosuite_side.py` and answers requests.

    `Robosuite.find()` is None where it is not installed.
    """

    def __init__(self, python: Path) -> None:
        script = ROOT / "benchmarks" / "peers" / "robosuite_side.py"
        self._process = subprocess.Popen(
            [python, script],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=os.environ | {"PYTHONPATH": "", "PYTHONWARNINGS": "ignore"},
        )
        self.versions: dict[str, str] = self.ask("versions")

    @classmethod
    def find(cls) -> "Robosuite | None":
        """Start it, where `make bench-peers` has installed it."""
        python = ROOT / ".venv-robosuite" / "bin" / "python"
        python = Path(os.environ.get("ROBOSUITE_PYTHON", python))
        return cls(python) if python.exists() else None

    def ask(self, request: str, **values: Any) -> Any:
        """Send one request and wait for its answer.

        Raises:
            RuntimeError: If it failed; carries the peer's own message.
        """
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps({"request": request, **values}) + "\n")
        process.stdin.flush()
        line = process.stdout.readline()
        if not line:
            raise RuntimeError(f"robosuite ended at '{request}'.")
        answer = json.loads(line)
        if "error" in answer:
            raise RuntimeError(f"robosuite, {request}: {answer['error']}")
        return answer["result"]

    def close(self) -> None:
        """End the process."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process.wait(timeout=30)
