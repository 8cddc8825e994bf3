"""No test asserts a wall-clock time: a busy machine is no failure."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
CLOCK = r"(?:perf_counter|monotonic|time\.time)\(\)"
ASSERTED = re.compile(rf"assert [^\n]*{CLOCK} - |assert [^\n]*\b(?:spent|elapsed) <")
OTHERS = {"tests/browser/screens.py"}
"""Its time is that of a person, not of a clock."""


def test_no_test_asserts_a_wall_clock_time():
    """Time-outs may end what hangs: `assert time.monotonic() < deadline`."""
    found = {
        path.relative_to(ROOT).as_posix()
        for path in sorted((ROOT / "tests").rglob("*.py"))
        if path != Path(__file__)
        and ASSERTED.search(path.read_text(encoding="utf-8", errors="replace"))
    }
    assert found <= OTHERS


def test_times_that_are_asserted_are_found():
    assert ASSERTED.search("    assert time.perf_counter() - begun < 10.0")
    assert ASSERTED.search("    assert spent < SOON")
    assert not ASSERTED.search("    assert time.monotonic() < deadline")
