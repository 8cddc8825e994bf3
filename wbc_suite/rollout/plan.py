"""Which episodes there are, cut into items of work."""

import hashlib
import json
import re
from collections.abc import Iterable
from dataclasses import dataclass

from wbc_suite.errors import ConfigError
from wbc_suite.executors import Item

__all__ = ["Case", "plan"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Case:
    """An environment and who acts in it.

    Attributes:
        benchmark: Its name, or a file.
        robots: Their names.
        controller: A name or a file; None for each robot's own.
        policy: See `wbc_suite.policies.make_policy`.
        record: Whether episodes are recorded.
        arguments: Further ones of `wbc_suite.make`, as JSON would carry them, sorted.
    """

    benchmark: str
    robots: tuple[str, ...]
    controller: str | None = None
    policy: str = "random"
    record: bool = False
    arguments: tuple[tuple[str, str | int | float | bool], ...] = ()

    @property
    def title(self) -> str:
        """The case in a line."""
        parts = (self.benchmark, "+".join(self.robots), self.controller, self.policy)
        return " ".join(p for p in parts if p)


def plan(cases: Iterable[Case], *, seeds: range, chunk: int) -> list[Item]:
    """Cut the episodes of all cases into items of `chunk` seeds each.

    The same episodes get the same items, whatever else is asked for beside them.

    Raises:
        ConfigError: If there are no seeds, or the chunk is empty.
    """
    if len(seeds) == 0 or seeds.start < 0 or seeds.step != 1 or chunk < 1:
        raise ConfigError(f"Seeds {seeds} in chunks of {chunk}: at least one of each.")
    starts = range(seeds.start, seeds.stop, chunk)
    return [
        _item(case, start, min(start + chunk, seeds.stop))
        for case in cases
        for start in starts
    ]


def _item(case: Case, start: int, stop: int) -> Item:
    payload = {
        "benchmark": case.benchmark,
        "robots": list(case.robots),
        "controller": case.controller,
        "policy": case.policy,
        "record": case.record,
        "arguments": dict(case.arguments),
        "seeds": [start, stop],
    }
    digest = hashlib.sha256(json.dumps(payload, sort_keys=True).encode()).hexdigest()[
        :8
    ]
    words = re.sub(r"[^A-Za-z0-9]+", "-", case.title).strip("-")[:90]
    return Item(name=f"{words}-{start:06d}-{digest}", payload=payload)
