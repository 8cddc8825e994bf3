"""Memory of a process, as Linux counts it."""

import os
from pathlib import Path

__all__ = ["resident"]


def resident(process: int | str = "self") -> float:
    """Return the memory that a process holds, MB.

    What it has freed counts as long as the process keeps it.
    """
    pages = int(Path(f"/proc/{process}/statm").read_text("utf-8").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
