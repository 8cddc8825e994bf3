"""What commands print."""

import builtins
from typing import TextIO

from wbc_suite.errors import printable


def print(
    *values: object, end: str = "\n", file: TextIO | None = None, flush: bool = False
) -> None:
    """Print as Python does, but escape control characters of names and texts."""
    text = " ".join(printable(str(value)) for value in values)
    builtins.print(text, end=end, file=file, flush=flush)
