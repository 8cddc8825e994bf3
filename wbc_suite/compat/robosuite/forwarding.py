"""Names that only lead elsewhere: re-exported, forwarded, or without effect here."""

import importlib
from collections.abc import Callable
from typing import Any


def names_of(package: str, *modules: str) -> tuple[Any, Any]:
    """Return `__getattr__` and `__dir__` of a package with the names of its modules.

    Modules are imported when a name is asked for that the package does not have.
    """

    def names() -> dict[str, Any]:
        found: dict[str, Any] = {}
        for module in modules:
            own = vars(importlib.import_module(f"{package}.{module}"))
            found |= {n: v for n, v in own.items() if not n.startswith("_")}
        return found

    def find(name: str) -> Any:
        if name == "__all__":
            return list(names())
        if not name.startswith("_") and name in (known := names()):
            return known[name]
        raise AttributeError(f"module '{package}' has no attribute '{name}'")

    return find, lambda: list(names())


def does_nothing(why: str) -> Callable[..., None]:
    """Return a method that robosuite's scripts call, and that has no effect here."""

    def method(self: Any, *args: Any, **kwargs: Any) -> None:
        pass

    method.__doc__ = f"Do nothing: {why}."
    return method


def forwarded(target: str, name: str, doc: str) -> Any:
    """Return a property: an attribute, or a method, of the attribute `target`."""
    return property(lambda self: getattr(getattr(self, target), name), doc=doc)
