"""What all tests share."""

import pytest
from hypothesis import HealthCheck, settings
from xdist.scheduler import LoadScopeScheduling

settings.register_profile(
    "suite",
    deadline=None,  # a busy machine is no failure
    suppress_health_check=list(HealthCheck),
    derandomize=True,
    database=None,
)
settings.load_profile("suite")


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
