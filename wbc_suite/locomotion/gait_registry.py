"""Gaits by name: planners, and the models of their numbers."""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias, get_args

from wbc_suite.errors import ConfigError
from wbc_suite.locomotion.gait import (
    Gait,
    GaitConfig,
    Measured,
    Plan,
    TrotConfig,
    WalkConfig,
)
from wbc_suite.locomotion.trot import plan_trot
from wbc_suite.locomotion.walk import plan_walk
from wbc_suite.registry import Registry
from wbc_suite.typing import Vector

Planner: TypeAlias = Callable[[Gait, Measured, Vector, float, Plan], None]
"""A kernel `(gait, measured, command, dt, plan)`; see `plan_trot`."""


class GaitKind(NamedTuple):
    """A registered gait: its planner, and the model of `[gait]` in controller files."""

    plan: Planner
    config: type[GaitConfig]


def _check(name: str, kind: GaitKind) -> None:
    field = kind.config.model_fields["type"]
    if name not in get_args(field.annotation):
        raise ConfigError(
            f"{kind.config.__name__}: gait '{name}' needs the field "
            f"type: Literal['{name}'] = '{name}'."
        )


GAITS: Registry[GaitKind] = Registry("gait", check=_check)
"""Gaits by name."""


def register_gait(
    name: str, plan: Planner, config: type[GaitConfig], *, replace: bool = False
) -> None:
    """Add a gait to those that `[gait]` of a controller file may name by `type`.

    Args:
        name: Its name.
        plan: A kernel of `wbc_suite.compiling.compiled`. It is called at every physics
            step, and may keep numbers in `gait.state` and `gait.goal`.
        config: Model of its numbers.
        replace: Whether it takes the place of a gait that has the name.

    Raises:
        ConfigError: If the name is taken, or the config's type is not that name.
    """
    GAITS.register(name, GaitKind(plan, config), replace=replace)


register_gait("trot", plan_trot, TrotConfig)
register_gait("walk", plan_walk, WalkConfig)
