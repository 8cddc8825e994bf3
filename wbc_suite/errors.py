"""The errors that this package raises.

Each class also derives from the built-in error that it refines, so that code without
knowledge of this package can catch it. A message states what was asked, what was found,
what is allowed, and what to do.
"""

import difflib
from collections.abc import Collection, Mapping, Sequence
from typing import TypeVar

MAX_NAMES = 25  # largest number of names in a message

T = TypeVar("T")


def did_you_mean(name: str, known: Collection[str]) -> str:
    """Return " Did you mean 'x'?" for the closest spelling, or ""; case is ignored."""
    folded = {k.casefold(): k for k in known}
    close = difflib.get_close_matches(name.casefold(), folded, n=1)
    return f" Did you mean '{folded[close[0]]}'?" if close else ""


def join_first(items: Sequence[str], *, limit: int = 6, separator: str = ", ") -> str:
    """Join the first items of a list for a message, and count the others."""
    hidden = len(items) - limit
    more = f" and {hidden} more" if hidden > 0 else ""
    return separator.join(items[:limit]) + more


def shortened(text: str, limit: int = 80) -> str:
    """Return a text for a message, cut to a number of characters."""
    return text if len(text) <= limit else text[: limit - 3] + "..."


def printable(text: str) -> str:
    """Return a text for a terminal: control characters but new lines are escaped."""
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c in "\n\t" else c.encode("unicode_escape").decode()
        for c in text
    )


class WbcError(Exception):
    """Base class of all errors that this package raises."""

    def __str__(self) -> str:
        """Return the message, `printable`: names in it may come from anywhere."""
        return printable(super().__str__())


class ConfigError(WbcError, ValueError):
    """A file, a key or a value of a configuration is wrong."""


class UnknownArgumentError(ConfigError, TypeError):
    """A function has no argument of a name, in the words of Python's own TypeError.

    Libraries that try arguments, as TorchRL does with `frameskip`, look for these, and
    Gymnasium makes the error anew from its text.
    """


class DescriptionError(ConfigError):
    """A robot description is inconsistent or physically impossible."""


class UnknownNameError(WbcError, LookupError):
    """A name is missing from the collection it was looked up in.

    Args:
        kind: Kind of item, such as "robot".
        name: Name that was asked for.
        known: Existing names.
    """

    def __init__(self, kind: str, name: object, known: Collection[str]) -> None:
        asked = name if isinstance(name, str) else repr(name)
        hint = did_you_mean(asked, known) if isinstance(name, str) else ""
        names = join_first(sorted(known), limit=MAX_NAMES) or "none"
        super().__init__(f"No {kind} named '{shortened(asked)}'.{hint} Known: {names}.")
        self.kind, self.name, self.known = kind, name, tuple(known)

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        """Support pickling, since vector environments send errors across processes."""
        return type(self), (self.kind, self.name, self.known)


def look_up(kind: str, name: str, items: Mapping[str, T]) -> T:
    """Return the item with a name; raises UnknownNameError."""
    try:
        return items[name]
    except (KeyError, TypeError):
        raise UnknownNameError(kind, name, items) from None


class ActionError(WbcError, ValueError):
    """An action has a wrong shape, type or value."""


class SolverError(WbcError, RuntimeError):
    """A QP solver is not installed, or does not support the request."""


class PlacementError(WbcError, RuntimeError):
    """No free pose was found for an object."""


class PhysicsError(WbcError, RuntimeError):
    """The physics engine reported an error."""


class DatasetError(WbcError, ValueError):
    """A recording cannot be read or written."""


class DeviceError(WbcError, RuntimeError):
    """An input device or a server is missing or failed."""
