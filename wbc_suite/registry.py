"""`Registry`: names of what users can add, such as benchmarks, devices and gaits."""

import importlib
import sys
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any, Generic, TypeVar

from wbc_suite.catalogue import name_key
from wbc_suite.errors import ConfigError, UnknownNameError

T = TypeVar("T")


class Registry(Collection[str], Generic[T]):
    """Items of one kind by name; a name is read without regard to case, `_` and `-`.

    `registry[name]` is an item, `name in registry` tells whether there is one, and
    iteration yields the names as they were registered, in this order.

    Args:
        kind: What an item is called in messages, such as "device".
        check: Called with name and item before it is registered; raises ConfigError.
    """

    def __init__(
        self, kind: str, *, check: Callable[[str, Any], None] = lambda name, item: None
    ) -> None:
        self.kind, self._check = kind, check
        self._items: dict[str, tuple[str, T | str]] = {}

    def register(self, name: str, item: T | str, *, replace: bool = False) -> None:
        """Add an item, or its place `module:Name`, which is imported when needed.

        Args:
            name: Its name.
            item: What it stands for.
            replace: Whether it takes the place of an item that has the name.

        Raises:
            ConfigError: If the name is taken or no name, or the item is not accepted.
        """
        if not isinstance(name, str) or not name_key(name) or ":" in name:
            raise ConfigError(f"{name!r} cannot be the name of a {self.kind}.")
        if name in self and not replace:
            raise ConfigError(
                f"A {self.kind} named '{self.spelled(name)}' exists already. Choose "
                "another name, or replace it with replace=True."
            )
        if not isinstance(item, str):
            self._check(name, item)
        self._items[name_key(name)] = name, item

    def spelled(self, name: object) -> str:
        """Return a name as it was registered; raises UnknownNameError."""
        return self._entry(name)[0]

    def find(self, name: str) -> T:
        """Return an item by its name, or what `module:Name` stands for.

        The module may also lie in the current directory. Only names that the user
        gave may come here, not those in a file or a message: importing runs code.

        Raises:
            UnknownNameError: If there is no item of this name.
            ConfigError: If the module cannot be imported, or lacks the name.
        """
        if name in self or ":" not in name:
            return self[name]
        return self._imported(name)

    def __getitem__(self, name: object) -> T:
        _, item = self._entry(name)
        return self._imported(item) if isinstance(item, str) else item

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name_key(name) in self._items

    def __iter__(self) -> Iterator[str]:
        return (name for name, _ in list(self._items.values()))

    def __len__(self) -> int:
        return len(self._items)

    def _entry(self, name: object) -> tuple[str, T | str]:
        if not isinstance(name, str) or name not in self:
            raise UnknownNameError(self.kind, name, self)
        return self._items[name_key(name)]

    def _imported(self, place: str) -> T:
        module, _, attribute = place.partition(":")
        here = str(Path.cwd())
        if here not in sys.path:
            sys.path.append(here)  # last, so that it hides nothing
        try:
            return getattr(importlib.import_module(module), attribute)
        except (ImportError, AttributeError, ValueError) as error:
            raise ConfigError(
                f"The {self.kind} '{place}' cannot be found: {error}. Write "
                "package.module:Name; every process must be able to import the module "
                "(from the current directory, or see PYTHONPATH)."
            ) from error
