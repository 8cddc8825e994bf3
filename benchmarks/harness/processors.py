"""Processor times, as counted by Linux."""

from pathlib import Path

import numpy as np

__all__ = ["processor_times", "stolen_time"]

_STOLEN = 7
"""Which of the processors' times went to other machines; see proc_stat(5)."""


def processor_times() -> np.ndarray:
    """Return what processors did since the start, in hundredths of a second.

    The times are in Linux's order, the last is what was stolen: what other machines on
    the same host took while this one had work.
    """
    (_, *times), *_ = map(str.split, Path("/proc/stat").read_text("utf-8").splitlines())
    return np.array(times[: _STOLEN + 1], dtype=float)


def stolen_time() -> float:
    """Return what was stolen of all processors' time, s; 0 where nothing tells."""
    try:
        return 0.01 * float(processor_times()[_STOLEN])
    except OSError:
        return 0.0
