"""Objects, of shapes or of MJCF files."""

from typing import Any

from wbc_suite.compat.robosuite.forwarding import names_of

_find, __dir__ = names_of(__name__, "bodies", "shapes", "composites", "ready_made")


def __getattr__(name: str) -> Any:
    return _find(name)
