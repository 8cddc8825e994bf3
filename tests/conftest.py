"""What all tests share."""

import json
import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from xdist.scheduler import LoadScopeScheduling

from wbc_suite.catalogue import name_key

settings.register_profile(
    "suite",
    deadline=None,  # a busy machine is no failure
    suppress_health_check=list(HealthCheck),
    derandomize=True,
    database=None,
)
settings.load_profile("suite")


ROOT = Path(__file__).parents[1]
PATIENCE = 900.0  # s; torch takes minutes to be imported for the first time
CONVERT = """
import sys
from wbc_suite.executors import Serial
from wbc_suite.recording.converting import convert
source, out, layout, pieces = sys.argv[1:]
if int(pieces) == 1:
    convert(source, out, layout)
else:
    convert(source, out, layout, executor=Serial(), workers=int(pieces))
"""


@pytest.fixture
def forget():
    """Return a function: a registry forgets names at the end of the test."""
    names = []
    yield lambda registry, *own: names.extend((registry, name) for name in own)
    for registry, name in names:
        registry._items.pop(name_key(name), None)


class PeerReaders:
    """Packages that read datasets, in the environment of the clients."""

    python = ROOT / ".venv-clients/bin/python"

    def run(self, *arguments):
        """Run their Python, with our modules; return what it prints last."""
        if not self.python.exists():
            pytest.skip("Readers of datasets are not installed: make bench-peers")
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "HF_HUB_OFFLINE": "1"}
        command = [self.python, *map(str, arguments)]
        output = subprocess.run(
            command, capture_output=True, text=True, timeout=PATIENCE, env=environment
        )
        assert output.returncode == 0, output.stderr[-3000:]
        return output.stdout.splitlines()[-1] if output.stdout else ""

    def read(self, kind, path):
        """Return what `benchmarks/peers/datasets_side.py` tells of a dataset."""
        side = ROOT / "benchmarks/peers/datasets_side.py"
        return json.loads(self.run(side, kind, path))

    def convert(self, source, out, layout, *, pieces=1):
        """Convert there: LeRobot's layout needs pyarrow and av."""
        self.run("-c", CONVERT, source, out, layout, pieces)
        return out


@pytest.fixture(scope="session")
def peer_readers():
    return PeerReaders()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what `sample` leaves out as a sweep: keep cases at even distances."""
    cases: dict[object, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("sample"):
            cases.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for same in cases.values():
        marker = same[0].get_closest_marker("sample")
        count = len(same)
        kept = {k * count // marker.args[0] for k in range(marker.args[0])}
        for k, item in enumerate(same):
            if k not in kept:
                item.add_marker(pytest.mark.sweep)


INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT") == "1"
INTERPRETED_LIMIT = float(os.environ.get("WBC_SUITE_INTERPRETED_LIMIT", "1.0"))
"""s of CPU time."""


def _too_slow(*_: object) -> None:
    pytest.skip(f"takes more than {INTERPRETED_LIMIT} s without compilation")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol() -> Iterator[None]:
    """Under NUMBA_DISABLE_JIT, run the tests that take little time without it."""
    if not INTERPRETED:
        return (yield)
    previous = signal.signal(signal.SIGPROF, _too_slow)
    try:
        return (yield)
    finally:
        signal.signal(signal.SIGPROF, previous)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Iterator[None]:
    """Skip a test that exceeds the limit."""
    signal.setitimer(signal.ITIMER_PROF, INTERPRETED_LIMIT if INTERPRETED else 0.0)
    try:
        return (yield)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


class BrowserOnOneWorker(LoadScopeScheduling):
    """Spreads tests over the workers one by one, but keeps a browser's together.

    They measure latency, and two Chromiums that draw at once would take it from each
    other. (pytest-xdist's own `loadgroup` does not see its groups under pytest 9.2.)
    """

    def _split_scope(self, nodeid: str) -> str:
        return "browser" if nodeid.startswith("tests/browser/") else nodeid


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(
    config: pytest.Config, log: object
) -> BrowserOnOneWorker:
    """Make the scheduler of `pytest -n`."""
    return BrowserOnOneWorker(config, log)
