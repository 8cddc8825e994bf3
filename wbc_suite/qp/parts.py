"""What a stack is made of: whether it was given that, and nothing else."""

from collections.abc import Sequence
from typing import cast

from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.equality import Equality
from wbc_suite.qp.limit import Limit
from wbc_suite.qp.task import RowTask, Task

__all__ = ["check_parts"]


def check_parts(
    configuration: object, tasks: object, limits: object, equalities: object
) -> None:
    """Raise ConfigError if a part is of another kind, or two share a name.

    Args:
        configuration: Should be a `Configuration`.
        tasks: Should be a list of tasks; those with rows are reported by name.
        limits: Should be a list of limits, or None.
        equalities: Should be a list of equality rows.
    """
    if not isinstance(configuration, Configuration):
        raise ConfigError(
            f"TaskStack needs a Configuration, not {type(configuration).__name__}."
        )
    _check_list("limits", limits if limits is not None else (), Limit)
    _check_list("equalities", equalities, Equality)
    names = [
        t.name for t in _check_list("tasks", tasks, Task) if isinstance(t, RowTask)
    ]
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(
                f"TaskStack: two tasks are named '{name}', and reports go by name. "
                "Give one of them another name=..."
            )


def _check_list(what: str, given: object, kind: type) -> Sequence[object]:
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise ConfigError(f"TaskStack: {what} are a list, not {given!r:.60}.")
    items = cast("Sequence[object]", given)
    for item in items:
        if not isinstance(item, kind):
            raise ConfigError(
                f"TaskStack: {what} hold {kind.__name__} objects, not {item!r:.60}."
            )
    return items
