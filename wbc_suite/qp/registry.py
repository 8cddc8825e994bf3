"""Tasks and limits by name, as controller files name them."""

import inspect
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from wbc_suite.errors import ConfigError, WbcError
from wbc_suite.qp.com_task import ComTask
from wbc_suite.qp.frame_task import FrameTask, RelativeFrameTask
from wbc_suite.qp.joint_limits import AccelerationLimit, PositionLimit, VelocityLimit
from wbc_suite.qp.joint_tasks import DampingTask, JointCouplingTask, PostureTask
from wbc_suite.qp.limit import Limit
from wbc_suite.qp.look_at_task import LookAtTask
from wbc_suite.qp.plane_limits import FloorLimit
from wbc_suite.qp.task import Task
from wbc_suite.registry import Registry

T = TypeVar("T")

TASKS: Registry[Callable[..., Task]] = Registry("task")
LIMITS: Registry[Callable[..., Limit]] = Registry("limit")


def register_task(
    name: str, make: Callable[..., Task], *, replace: bool = False
) -> None:
    """Add a task for `[[task]]` of controller files.

    Args:
        name: Value of `type` there.
        make: Class or function; the other keys of the table are its arguments.
        replace: Whether it takes the place of a task that has the name.

    Raises:
        ConfigError: If the name is taken.
    """
    TASKS.register(name, make, replace=replace)


def register_limit(
    name: str, make: Callable[..., Limit], *, replace: bool = False
) -> None:
    """Add a limit for `[[limit]]` of controller files; see `register_task`."""
    LIMITS.register(name, make, replace=replace)


def made_of(registry: Registry[Callable[..., T]], table: Mapping[str, Any]) -> T:
    """Return the task or limit of a table: its `type`, and arguments.

    Raises:
        UnknownNameError: If nothing is registered by the type.
        ConfigError: If there are other arguments than it takes, or of another type.
    """
    arguments = dict(table)
    name = str(arguments.pop("type"))
    make = registry[name]
    try:
        inspect.signature(make).bind(**arguments)
        return make(**arguments)
    except WbcError:
        raise
    except (TypeError, ValueError, AttributeError) as error:
        raise ConfigError(f"{registry.kind} '{name}': {error}.") from error


for _task in (
    *(ComTask, DampingTask, FrameTask, JointCouplingTask),
    *(LookAtTask, PostureTask, RelativeFrameTask),
):
    register_task(_task.__name__, _task)
for _limit in (AccelerationLimit, FloorLimit, PositionLimit, VelocityLimit):
    register_limit(_limit.__name__, _limit)
