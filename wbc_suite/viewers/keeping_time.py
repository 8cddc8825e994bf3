"""What lets a loop keep its beat: Python's turns and garbage, the system's queue."""

import contextlib
import gc
import os
import sys

__all__ = ["SWITCH_INTERVAL", "calm_python", "run_first"]

SWITCH_INTERVAL = 1e-4  # s; at 1 ms, or Python's own 5, other threads hold the loop up


def calm_python() -> None:
    """Ready the interpreter for a loop in time: short turns, short collections.

    A collection of garbage that goes through all that was loaded and built takes many
    periods; what the loop leaves behind is little.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    gc.collect()
    gc.freeze()


def run_first(rank: int) -> None:
    """Have this thread run before those of other programs, where the system lets it.

    Linux lets administrators, and users with `rtprio` in /etc/security/limits.conf.
    What the thread starts is not raised with it.

    Args:
        rank: Its place among threads that run first, from 1; the highest comes first.
    """
    with contextlib.suppress(AttributeError, OSError):
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(rank))
