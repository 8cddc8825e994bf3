"""One piece of work, and what came of it."""

import re
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from wbc_suite.errors import ConfigError, WbcError

__all__ = ["Item", "Json", "Outcome", "Work", "attempt"]

Json: TypeAlias = "bool | int | float | str | list[Json] | dict[str, Json] | None"

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,150}")


@dataclass(frozen=True, kw_only=True, slots=True)
class Item:
    """A piece of work that can be done alone, again, and on another machine.

    Attributes:
        name: Names its result file; letters, digits, dots, dashes and underscores.
        payload: What the work is told, as JSON would carry it.
    """

    name: str
    payload: Mapping[str, Json]

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ConfigError(
                f"'{self.name}' cannot name an item: letters, digits, '.', '_' and '-' "
                "only, as it becomes the name of a file."
            )


Work: TypeAlias = Callable[[Item, Path], Mapping[str, Json]]
"""A function of a module (workers import it): item and folder to result."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Outcome:
    """What came of an item: a result, or an error in words.

    Attributes:
        name: The item's name.
        result: What the work returned; empty after an error.
        error: None, or what went wrong.
    """

    name: str
    result: Mapping[str, Json] = field(default_factory=dict)
    error: str | None = None


def attempt(work: Work, item: Item, folder: Path) -> Outcome:
    """Do an item; an exception becomes an outcome that tells it."""
    try:
        return Outcome(name=item.name, result=dict(work(item, folder)))
    except WbcError as error:
        return Outcome(name=item.name, error=f"{type(error).__name__}: {error}")
    except Exception:  # noqa: BLE001  # one bad item must not end all the others
        return Outcome(name=item.name, error=traceback.format_exc(limit=-4))
