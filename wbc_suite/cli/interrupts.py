"""Ctrl-C and SIGTERM: every command ends within a second, with exit code 130 or 143.

Python handles a signal only when the main thread returns from C, which compiling and
simulating delay. So a thread hears of the signal at once, and ends the process if
cleaning up takes longer than `GRACE`. Nothing finished is lost by that: files are
written whole or not at all, and recordings keep each episode in a file of its own.
"""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from types import FrameType
from typing import NoReturn

GRACE = 0.7  # s, for cleaning up
SIGNALS = (signal.SIGINT, signal.SIGTERM)
KEPT = {
    **dict.fromkeys(
        ("record", "multiply", "evaluate"),
        "Finished episodes are kept; run the same command to continue.",
    ),
    "teleop": "Finished episodes are kept; --record with the same file adds more.",
    "extract": "Finished parts are kept; run the same command to continue.",
    "convert": "Run the same command to continue with --executor process, ray or "
    "slurm, which keeps finished parts; without one it starts again.",
}
LIBRARIES = ("numba", "llvmlite")
IMPORTS = "<frozen importlib"
_SAID = threading.Lock()
OTHER = "No file is left half-written. Run the command again."


@contextmanager
def signals_end_the_process() -> Iterator[None]:
    """End this process by the first Ctrl-C or SIGTERM in the block."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    # Semaphores that a killed process leaves are removed; no user needs to hear of it.
    os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker")
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    earlier = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    received = list[int]()
    stop = partial(_stop, received)
    handlers = [signal.signal(number, stop) for number in SIGNALS]
    threading.Thread(
        target=_end_in_time, args=(reader,), name="interrupts", daemon=True
    ).start()
    try:
        yield
    finally:
        if received:  # whatever the exception has become on its way
            _leave(received[0])
        for number, handler in zip(SIGNALS, handlers, strict=True):
            signal.signal(number, handler)
        signal.set_wakeup_fd(earlier)
        os.close(writer)


def _stop(received: list[int], number: int, frame: FrameType | None) -> NoReturn:
    received.append(number)
    for each in SIGNALS:  # another one does not disturb the cleaning up
        signal.signal(each, signal.SIG_IGN)
    sys.unraisablehook = lambda _: None  # if it comes in a callback, which drops it
    _say_what_is_kept()
    if _builds_a_library(frame):
        _leave(number)
    raise SystemExit(128 + number)


def _builds_a_library(frame: FrameType | None) -> bool:
    """Return whether the main thread imports a module or compiles a kernel.

    Libraries in C++ call Python then, and crash if it raises.
    """
    while frame is not None:
        package = frame.f_globals.get("__name__", "").partition(".")[0]
        if package in LIBRARIES or frame.f_code.co_filename.startswith(IMPORTS):
            return True
        frame = frame.f_back
    return False


def _say_what_is_kept() -> None:
    if _SAID.acquire(blocking=False):  # by the first of the two threads
        command = sys.argv[1] if len(sys.argv) > 1 else ""
        text = f"\nwbc-suite: stopped. {KEPT.get(command, OTHER)}\n"
        os.write(2, text.encode())


def _end_in_time(reader: int) -> None:
    """End the process if it does not end by itself after a signal."""
    number = 0
    while number not in SIGNALS:
        if not (received := os.read(reader, 1)):  # the block has ended
            os.close(reader)
            return
        number = received[0]
    threading.Event().wait(GRACE / 2)
    _say_what_is_kept()
    threading.Event().wait(GRACE / 2)
    _leave(number)


def _leave(number: int) -> NoReturn:
    """End the process, without what Python does at its end.

    A signal that comes in a callback of LLVM leaves half a library behind, and that end
    crashed; and libraries make exceptions of their own of `SystemExit`.
    """
    for child in reversed(_descendants(os.getpid())):
        with suppress(OSError):
            if b"resource_tracker" not in Path(f"/proc/{child}/cmdline").read_bytes():
                os.kill(child, signal.SIGKILL)
    for child in multiprocessing.active_children():
        child.kill()
    with suppress(OSError, ValueError):
        sys.stdout.flush()
    os._exit(128 + number)


def _descendants(process: int) -> list[int]:
    """Return the processes below one, on Linux: glfw's print if they lose theirs."""
    found = list[int]()
    for children in Path(f"/proc/{process}/task").glob("*/children"):
        with suppress(OSError):
            for child in map(int, children.read_text().split()):
                found += [child, *_descendants(child)]
    return found
