"""Wrappers of environments."""

from typing import Any

from wbc_suite.compat.robosuite.forwarding import names_of

_find, __dir__ = names_of(__name__, "collecting", "gym", "plain")


def __getattr__(name: str) -> Any:
    return _find(name)
