"""`import robosuite` imports our package in these tests."""

import sys

import pytest

import wbc_suite.compat.robosuite as here


def _own(name):
    return name == "robosuite" or name.startswith("robosuite.")


@pytest.fixture(scope="session")
def suite():
    """The package under the name `robosuite`, for the whole run."""
    kept = {name: module for name, module in sys.modules.items() if _own(name)}
    here.install_alias()
    yield sys.modules["robosuite"]
    for name in [name for name in sys.modules if _own(name)]:
        del sys.modules[name]
    sys.modules.update(kept)
