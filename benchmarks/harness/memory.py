"""Memory of a process, as counted by Linux."""

import os
import re
from pathlib import Path

__all__ = ["forget_peak", "peak", "resident"]


def resident(process: int | str = "self") -> float:
    """Return the memory that a process holds, MB.

    What it has freed counts as long as the process keeps it.
    """
    pages = int(Path(f"/proc/{process}/statm").read_text("utf-8").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def forget_peak() -> None:
    """Let `peak` begin anew."""
    Path("/proc/self/clear_refs").write_text("5", "utf-8")


def peak() -> float:
    """Return the most that this process held since it began or `forget_peak`, MB."""
    told = Path("/proc/self/status").read_text("utf-8")
    found = re.search(r"VmHWM:\s+(\d+) kB", told)
    assert found is not None, "Linux says so"
    return int(found[1]) * 1024 / 1e6
