"""The one tree of errors that this package raises.

Each class also derives from the built-in error that it refines, so that code which
knows nothing of this package still catches it in a natural way. Messages say what was
asked, what was found, what is allowed, and what to do.
"""

import difflib
from collections.abc import Collection

__all__ = [
    "ActionError",
    "ConfigError",
    "DatasetError",
    "DescriptionError",
    "DeviceError",
    "PhysicsError",
    "PlacementError",
    "SolverError",
    "UnknownNameError",
    "WbcError",
    "nearest_name",
]

MAX_NAMES = 25
"""Names that a message lists at most."""
MAX_LENGTH = 80
"""Characters of a name that a message shows at most."""


def nearest_name(name: str, known: Collection[str]) -> str | None:
    """Return the known name closest in spelling, or None when none is near.

    Upper and lower case count as equal.
    """
    folded = {k.casefold(): k for k in known}
    close = difflib.get_close_matches(name.casefold(), folded, n=1)
    return folded[close[0]] if close else None


class WbcError(Exception):
    """Root of every error that this package raises on purpose."""


class ConfigError(WbcError, ValueError):
    """A file, a key or a value of a configuration is wrong."""


class DescriptionError(ConfigError):
    """A robot description contradicts itself or physics."""


class UnknownNameError(WbcError, LookupError):
    """A name is missing from the collection it was looked up in.

    Attributes:
        kind: What the name should be the name of.
        name: What was asked for.
        known: The names there are.
    """

    def __init__(self, kind: str, name: object, known: Collection[str]) -> None:
        asked = name if isinstance(name, str) else repr(name)
        close = nearest_name(asked, known) if isinstance(name, str) else None
        hint = f" Did you mean '{close}'?" if close else ""
        shown = asked if len(asked) <= MAX_LENGTH else asked[:MAX_LENGTH] + "..."
        super().__init__(
            f"No {kind} named '{shown}'.{hint} Known: {_list_names(known)}."
        )
        self.kind, self.name, self.known = kind, name, tuple(known)

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        """Let it pass between processes, as errors of vector environments do."""
        return type(self), (self.kind, self.name, self.known)


def _list_names(names: Collection[str]) -> str:
    """List names for a message; a humanoid's hundred frames are cut short."""
    shown = sorted(names)[:MAX_NAMES]
    hidden = len(names) - len(shown)
    return (", ".join(shown) or "none") + (f" and {hidden} more" if hidden else "")


class ActionError(WbcError, ValueError):
    """An action has a wrong shape, type or value."""


class SolverError(WbcError, RuntimeError):
    """A QP solver is missing or was asked for something it cannot do."""


class PlacementError(WbcError, RuntimeError):
    """No free pose was found for an object."""


class PhysicsError(WbcError, RuntimeError):
    """The physics engine reported a fault."""


class DatasetError(WbcError, ValueError):
    """A recording cannot be read or written as asked."""


class DeviceError(WbcError, RuntimeError):
    """An input device or a server is missing or misbehaves."""
