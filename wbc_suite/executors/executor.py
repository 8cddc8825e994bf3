"""Work items, their outcomes, and the interface of what runs them."""

import hashlib
import json
import re
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from wbc_suite.errors import ConfigError, WbcError

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,150}")


@dataclass(frozen=True, kw_only=True, slots=True)
class WorkItem:
    """A unit of work that can run alone, again, and on another machine.

    The name, of letters, digits, dots, dashes and underscores, names its result file;
    the payload has the arguments of the work, plain JSON data.
    """

    name: str
    payload: Mapping[str, Any]

    @classmethod
    def with_digest(cls, label: str, payload: Mapping[str, Any]) -> "WorkItem":
        """Make an item whose name is a label and a digest of its payload."""
        text = json.dumps(payload, sort_keys=True)
        digest = hashlib.sha256(text.encode()).hexdigest()[:12]
        return cls(name=f"{label}-{digest}", payload=payload)

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ConfigError(
                f"'{self.name}' cannot name an item: letters, digits, '.', '_' and '-' "
                "only, as it becomes the name of a file."
            )


@dataclass(frozen=True, kw_only=True, slots=True)
class Outcome:
    """Result of an item, plain JSON data, or its error message."""

    name: str
    result: Mapping[str, Any] = field(default_factory=dict)
    error: str | None = None


Work: TypeAlias = Callable[[WorkItem, Path], Mapping[str, Any]]
"""A function of an importable module: from an item and a folder to a result."""


class Executor(Protocol):
    """Runs items in any order and on any machine, and yields outcomes as they end."""

    def run(
        self, work: Work, items: Sequence[WorkItem], folder: Path
    ) -> Iterator[Outcome]:
        """Run all items; yield one outcome per item.

        Every worker must reach the folder, where the work may write. If a worker dies,
        the other items are not affected; its own item runs again, and fails if its
        worker dies every time.
        """
        ...


def run_item(work: Work, item: WorkItem, folder: Path) -> Outcome:
    """Run one item; an exception becomes the outcome's error."""
    try:
        return Outcome(name=item.name, result=dict(work(item, folder)))
    except WbcError as error:
        return Outcome(name=item.name, error=f"{type(error).__name__}: {error}")
    except Exception:  # noqa: BLE001  # one failed item must not end the others
        return Outcome(name=item.name, error=traceback.format_exc(limit=-4))
