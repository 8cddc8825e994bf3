"""Hooks of `mkdocs build`."""

import re
from typing import Any

PLACES = "(?:examples|controllers|robots)"
OUTSIDE = re.compile(rf"\[[^\]]+\]\((?:\.\./)+({PLACES}[^)]*)\)")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Write links to files of the repository as paths: the site does not hold them."""
    return OUTSIDE.sub(r"`\1`", markdown)
