"""The kernels that the control loop calls by their address: those of its laws."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from wbc_suite.compiling import (
    Callback,
    as_argument,
    by_address,
    compiled,
    inner,
    plain,
    struct,
)
from wbc_suite.control.composite.tick import run_tick
from wbc_suite.control.dynamics.solve_tick import solve_whole_body, write_whole_body
from wbc_suite.control.law.custom import law_kernel
from wbc_suite.control.law.joint_laws import base_law, joint_law, velocity_law
from wbc_suite.control.law.osc import osc_law
from wbc_suite.control.law.osc_saturation import keep_direction
from wbc_suite.control.loop.disturbance_observer import observe_disturbances
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.records import (
    DRIVE,
    LAW,
    CompiledRecords,
    LawKind,
    Records,
)
from wbc_suite.errors import ConfigError

MOST_KINDS = 8
"""Kinds of laws in one simulation: so many addresses have the same type."""


@struct
class LoopKernels(NamedTuple):
    """Kernels by their addresses; those that a simulation does not use do nothing.

    Attributes:
        law: Kernels of laws, shape (MOST_KINDS,); `LAW` records hold their places.
        prepare: Compiles `keep_direction` when that is called for the first time: most
            arms are far from their limits.
        keep_direction: See `osc_saturation`.
        observe: See `disturbance_observer`.
        run_tick: See `composite.tick`; None without ticks in the loop.
        solve_body: See `solve_tick`; None without robots on their feet.
        write_body: See `solve_tick`.
    """

    law: tuple[Callable[..., None], ...]
    prepare: Callable[[], None]
    keep_direction: Callable[..., None]
    observe: Callable[..., None]
    run_tick: Callable[..., bool]
    solve_body: Callable[..., bool]
    write_body: Callable[..., None]


@inner
def nothing() -> None:
    """Do nothing."""


@compiled
def adopt(
    kernels: LoopKernels, prepare: Callable[..., None], kernel: Callable[..., None]
) -> None:
    """Use another kernel as `keep_direction`."""
    kernels.prepare, kernels.keep_direction = prepare, kernel  # pyright: ignore


@inner
def no_law(physics: Physics, law: CompiledRecords, drives: CompiledRecords) -> None:
    """Do nothing."""


@inner
def no_observer(
    physics: Physics, laws: CompiledRecords, drives: CompiledRecords, bodies: Any
) -> None:
    """Do nothing."""


_LAWS: dict[int, Any] = {
    LawKind.JOINT: joint_law,
    LawKind.VELOCITY: velocity_law,
    LawKind.BASE: base_law,
    LawKind.OSC: osc_law,
}
_NONE = {LawKind.TORQUE, LawKind.SERVO, LawKind.DYNAMICS}
"""Laws that ask for no accelerations."""


DECIDING = "kind", "observer"
"""Fields of laws that decide which kernels they need."""


def bind_kernels(
    laws: Records,
    physics: Physics,
    bodies: Any = None,
    ticks: Any = None,
    *,
    compiled: bool = True,
) -> tuple[LoopKernels, object]:
    """Return the kernels that laws need, and write their places into the laws.

    The second value has to live as long as they do.

    Args:
        laws: `LAW` records.
        physics: The argument that kernels get.
        bodies: Robots on their feet, as kernels get them; None without any.
        ticks: Whole-body ticks that run in the loop; None without any.
        compiled: Whether kernels are compiled, or plain Python.

    Raises:
        ConfigError: If there are more than `MOST_KINDS` kinds of laws.
    """
    kinds = sorted(set(laws["kind"].tolist()) - _NONE)
    if len(kinds) >= MOST_KINDS:
        raise ConfigError(
            f"A simulation has {len(kinds)} kinds of laws, {MOST_KINDS - 1} at most."
        )
    law, drives = np.zeros(1, LAW)[0], np.zeros(0, DRIVE)

    def address(kernel: Any, *arguments: Any) -> Any:
        return by_address(kernel, *arguments) if compiled else plain(kernel)

    def prepare() -> None:
        adopt(found, address(nothing), address(keep_direction, *of_laws))

    of_laws, numbers = (physics, law, drives), np.zeros(0)
    of_tick = numbers, numbers, laws, drives
    kernels = [address(no_law, *of_laws)] * MOST_KINDS
    for k, kind in enumerate(kinds, 1):
        kernels[k] = address(_LAWS.get(kind) or law_kernel(kind), *of_laws)
        laws["kernel"][laws["kind"] == kind] = k
    observe = observe_disturbances if laws["observer"].any() else no_observer
    owner = Callback(prepare)
    run: Any = ticks and address(run_tick, ticks[0], *of_tick)
    solve: Any = bodies and address(solve_whole_body, physics, bodies[0])
    write: Any = bodies and address(write_whole_body, physics, bodies[0])
    found = LoopKernels(
        law=tuple(kernels),
        prepare=owner if compiled else nothing,
        keep_direction=kernels[0] if compiled else plain(keep_direction),
        observe=address(observe, physics, laws, drives, bodies),
        run_tick=run,
        solve_body=solve,
        write_body=write,
    )
    if compiled:
        found = as_argument(found)
    return found, owner
