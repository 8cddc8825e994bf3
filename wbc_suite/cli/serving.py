"""What the commands that serve a page share."""

import signal
import threading
from typing import Annotated, Protocol

import typer

__all__ = ["HostOption", "PortOption", "Served", "serve_until_interrupted"]

HostOption = Annotated[
    str,
    typer.Option(
        help="Address to listen on. Other than 127.0.0.1, the page asks for a token."
    ),
]

PortOption = Annotated[
    int | None,
    typer.Option(
        help="Port to listen on, 0 for any free one; the first free from 8080 on "
        "when left out.",
        min=0,
        max=65535,
    ),
]


class Served(Protocol):
    """Something that people open, at an address, with a token or none."""

    @property
    def url(self) -> str:
        """The address, with its token."""
        ...

    @property
    def token(self) -> str | None:
        """What people must bring."""
        ...


def serve_until_interrupted(
    site: Served, title: str, until: threading.Event | None = None
) -> None:
    """Print where the page is, and wait for Ctrl-C or a request to terminate.

    Args:
        site: What is served.
        title: What it is, for the terminal.
        until: Another reason to end.
    """
    interrupted = until or threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):  # before anybody knows the address
        signal.signal(number, lambda *_: interrupted.set())
    print(f"{title}\n\n    {site.url}\n", flush=True)
    if site.token is not None:
        print("Anybody with this address may use the page.", flush=True)
    print("Ctrl-C ends it.", flush=True)
    interrupted.wait()
