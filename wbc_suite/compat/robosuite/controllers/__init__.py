"""Controllers: robosuite's default configs, its registries, and classes of users."""

from typing import Any

from wbc_suite.compat.robosuite.forwarding import names_of

_find, __dir__ = names_of(__name__, "configs", "part_view", "user_controllers")


def __getattr__(name: str) -> Any:
    return _find(name)
