"""The sockets on which processes listen, read from Linux's `/proc`."""

import ipaddress
import re
from pathlib import Path
from typing import NamedTuple

LISTENS = "0A"  # state of a TCP socket
BOUND = "07"  # state of a UDP socket that is not connected
ACCEPTS = 0x10000  # flag of a Unix socket


class Listener(NamedTuple):
    """A socket that others can reach: `tcp`, `udp` or `unix`, and its address."""

    kind: str
    host: str  # or the path of a Unix socket; "@..." is one without a file
    port: int


def tree(pid):
    """Return a process and all its descendants."""
    found = [pid]
    for children in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in map(int, children.read_text().split()):
            found += tree(child)
    return found


def listening(pid):
    """Return all sockets on which a process or a descendant of it listens."""
    return sorted({listener for each in tree(pid) for listener in _of(each)})


def _of(pid):
    mine = set()
    for descriptor in Path(f"/proc/{pid}/fd").glob("*"):
        try:
            target = str(descriptor.readlink())
        except OSError:  # closed since
            continue
        mine |= set(re.findall(r"socket:\[(\d+)\]", target))
    for kind in ("tcp", "tcp6", "udp", "udp6"):
        for row in _rows(pid, kind):
            state, inode = row[3], row[9]
            if inode in mine and state == (LISTENS if "tcp" in kind else BOUND):
                host, _, port = row[1].partition(":")
                yield Listener(kind[:3], _address(host), int(port, 16))
    for row in _rows(pid, "unix"):
        if row[6] in mine and int(row[3], 16) & ACCEPTS:
            yield Listener("unix", row[7] if len(row) > 7 else "", 0)


def _rows(pid, table):
    lines = Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]
    return [line.split() for line in lines]


def _address(text):
    """Return an address: words of 32 bits, each with its lowest byte first."""
    words = [bytes.fromhex(text[k : k + 8])[::-1] for k in range(0, len(text), 8)]
    return str(ipaddress.ip_address(b"".join(words)))
