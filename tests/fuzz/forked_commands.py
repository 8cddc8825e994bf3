"""Commands in forks of a process that has imported all: how they end, what they use."""

import ctypes
import os
import resource
import struct
import sys
import sysconfig
import tempfile
import time
import traceback
from dataclasses import dataclass
from pathlib import Path

from wbc_suite.catalogue import temporary_root, user_cache_root, user_config
from wbc_suite.cli import main

SECONDS, MEGABYTES = 10.0, 1000.0
"""The most CPU time and memory of a command, s and MB."""
PATIENCE = 300.0  # s, on a busy machine
HEADROOM = 3 << 30  # bytes; what a command asks for beyond this is refused to it
SERVES = b"Press Ctrl-C"
"""What commands print that go on until they are stopped."""
IN_OPEN = 0x20  # of Linux's inotify.h
OWN = (
    *(
        Path(__file__).parents[2],
        Path(sys.prefix),
        Path(sys.base_prefix),
        user_config(),
    ),
    *(Path(path) for path in sysconfig.get_paths().values()),
    *(user_cache_root(), temporary_root(), Path("/proc/self"), Path("/proc/cpuinfo")),
    *map(Path, ("/usr", "/lib", "/lib64", "/etc/ssl", "/etc/localtime", "/dev/null")),
    *map(Path, ("/sys", "/dev/shm", "/dev/urandom", "/dev/dri", "/etc/ld.so.cache")),
)
"""Where the program, its libraries and its caches are."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a command ended."""

    line: str
    code: int
    seconds: float
    megabytes: float
    opened: tuple[str, ...]
    said: str

    @property
    def fault(self):
        """What is wrong with it, in a few words, or nothing."""
        if self.opened:
            return f"opens {', '.join(self.opened)[:200]}"
        if "Traceback" in self.said:
            return "a traceback"
        if self.code not in (0, 1, 2):
            return f"ends with {self.code}"
        if self.seconds > SECONDS:
            return f"takes {self.seconds:.1f} s"
        if self.megabytes > MEGABYTES:
            return f"takes {self.megabytes:.0f} MB"
        own = ("wbc-suite: ", "Usage:")
        lines = self.said.splitlines()
        if self.code == 2 and not any(line.startswith(own) for line in lines):
            return "a message that is not ours"
        return ""


class Watch:
    """Sees when any process opens one of some files, also from C."""

    def __init__(self, files):
        libc = ctypes.CDLL(None, use_errno=True)
        self._handle = libc.inotify_init1(os.O_NONBLOCK)
        self._files = {
            libc.inotify_add_watch(self._handle, os.fsencode(file), IN_OPEN): file
            for file in files
        }
        assert -1 not in self._files, "Linux has inotify"

    def opened(self):
        """Return which were opened since the last call."""
        try:
            events = os.read(self._handle, 1 << 16)
        except BlockingIOError:
            return set()
        numbers = struct.unpack_from(f"{len(events) // 16 * 4}i", events)[::4]
        return {str(self._files[number]) for number in numbers}


def run(line, folder, watch=None):
    """Run a command in a folder, in a fork; return its `Outcome`."""
    own, printed = folder.with_suffix(".opened"), folder.with_suffix(".printed")
    own.write_bytes(b"")
    printed.write_bytes(b"")
    child = os.fork()
    if child == 0:
        _be_the_command(line, folder, printed, own)
    status, used = _wait(child, printed)
    opened = {os.fsdecode(name) for name in own.read_bytes().split(b"\0") if name}
    opened |= watch.opened() if watch else set()
    said = printed.read_text(errors="replace")
    own.unlink()
    printed.unlink()
    return Outcome(
        line=line,
        code=status,
        seconds=used.ru_utime + used.ru_stime,
        megabytes=1024 * used.ru_maxrss / 1e6,
        opened=tuple(sorted(opened)),
        said=said,
    )


def _wait(child, printed):
    """Return exit code and usage; a command that serves is stopped, and ends with 0."""
    begun, stopped = time.monotonic(), False
    while True:
        ended, status, used = os.wait4(child, os.WNOHANG)
        if ended:
            code = os.waitstatus_to_exitcode(status)
            return (0 if stopped and code == 143 else code), used
        if not stopped and SERVES in printed.read_bytes():
            stopped = True
            os.kill(child, 15)
        if time.monotonic() - begun > PATIENCE:
            os.kill(child, 9)
        time.sleep(0.005)


def _be_the_command(line, folder, printed, own):
    """Run a command in this fork, and end it."""
    os.chdir(folder)
    os.environ["TMPDIR"] = tempfile.tempdir = str(folder)
    output = os.open(printed, os.O_WRONLY)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    sys.stdout, sys.stderr = (os.fdopen(k, "w") for k in (1, 2))
    sys.argv = ["wbc-suite", *line.split()]
    note = os.open(own, os.O_WRONLY | os.O_APPEND)
    allowed = tuple(os.path.realpath(path) for path in (folder, *OWN))

    def hook(event, arguments):
        if event == "open" and isinstance(arguments[0], str | bytes):
            path = os.path.realpath(os.fsdecode(arguments[0]))
            if not any(path == own or path.startswith(own + "/") for own in allowed):
                os.write(note, os.fsencode(path) + b"\0")

    sys.addaudithook(hook)
    _, most = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(6 * SECONDS), most))
    pages = int(Path("/proc/self/statm").read_text().split()[5])  # of data
    room = pages * resource.getpagesize() + HEADROOM
    resource.setrlimit(resource.RLIMIT_DATA, (room, room))
    code = 70
    try:
        main()
    except SystemExit as ended:
        code = ended.code or 0
    except BaseException:  # noqa: BLE001  (a fork must not go on as its parent)
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
