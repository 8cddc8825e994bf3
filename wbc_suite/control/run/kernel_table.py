"""The kernels that the control loop calls by their address: those of its laws."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from wbc_suite.compiling import (
    Callback,
    as_argument,
    by_address,
    compiled,
    inner,
    is_compiling,
    plain,
    struct,
)
from wbc_suite.control.contact.feet_tick import solve_whole_body, write_whole_body
from wbc_suite.control.contact.state_source import read_all_sensors, use_all_feet
from wbc_suite.control.ground.mujoco_functions import mj_kinematics, mj_step1
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.records import Drives, LawKind, LawRecord
from wbc_suite.control.ik.compiled_tick import run_tick
from wbc_suite.control.law.joint_laws import base_law, joint_law, velocity_law
from wbc_suite.control.law.law import law_kernel
from wbc_suite.control.law.osc import osc_law
from wbc_suite.control.law.osc_saturation import keep_direction
from wbc_suite.control.part.ik_tick import run_hand
from wbc_suite.control.run.data import LoopData, for_kernels, for_plain_python
from wbc_suite.control.run.disturbance_observer import (
    observe_disturbances,
    observe_roots,
)
from wbc_suite.errors import ConfigError

MOST_KINDS = 8
"""Kinds of laws in one simulation: so many addresses have the same type."""


@struct
class LoopKernels(NamedTuple):
    """Kernels by their addresses; those that a simulation does not use do nothing.

    Those that take the loop's data return whether the step goes on without Python.

    Attributes:
        law: Kernels of laws, shape (MOST_KINDS,); `LawRecord`s hold their places.
        prepare: Compiles `keep_direction` when that is called for the first time: most
            arms are far from their limits.
        keep_direction: See `osc_saturation`.
        observe_roots: See `disturbance_observer`.
        observe: See `disturbance_observer`.
        read_sensors: Writes the state that laws read.
        run_ticks: See `ik.compiled_tick`.
        run_hands: See `part.ik_tick`.
        solve_bodies: See `contact.feet_tick`.
        add_contacts: Subtracts the torques of contact forces from `physics.force`.
        pass_commands: Gives the commands of laws that read sensors to the actuators.
        override: Writes the commands of controllers in Python; see `SteppedController`.
    """

    law: tuple[Callable[..., None], ...]
    prepare: Callable[[], bool]
    keep_direction: Callable[..., None]
    observe_roots: Callable[[LoopData], bool]
    observe: Callable[[LoopData], bool]
    read_sensors: Callable[[LoopData], bool]
    run_ticks: Callable[[LoopData], bool]
    run_hands: Callable[[LoopData], bool]
    solve_bodies: Callable[[LoopData], bool]
    add_contacts: Callable[[LoopData], bool]
    pass_commands: Callable[[LoopData], bool]
    override: Callable[[], bool]


@inner
def nothing() -> bool:
    """Do nothing."""
    return True


@inner
def no_law(physics: Physics, law: LawRecord, drives: Drives) -> None:
    """Do nothing."""


@inner
def no_work(loop: LoopData) -> bool:
    """Do nothing."""
    return True


@compiled
def adopt(
    kernels: LoopKernels, prepare: Callable[..., bool], kernel: Callable[..., None]
) -> None:
    """Use another kernel as `keep_direction`."""
    kernels.prepare, kernels.keep_direction = prepare, kernel  # pyright: ignore


@inner
def read_sensors(loop: LoopData) -> bool:
    """Write what robots believe of their state."""
    read_all_sensors(loop.sources)
    mj_kinematics(loop.model, loop.believed)
    use_all_feet(loop.sources)
    mj_step1(loop.model, loop.believed)
    return True


@inner
def pass_commands(loop: LoopData) -> bool:
    """Give the commands that laws computed from the believed state to the actuators."""
    loop.sources[0].true_ctrl[:] = loop.physics.ctrl
    return True


@compiled
def run_ticks(loop: LoopData) -> bool:
    """Run the whole-body ticks that are due; return whether all of them are done."""
    if loop.resumes[0] == 1:
        return True
    qpos, qvel = loop.physics.qpos, loop.physics.qvel
    for tick in loop.ticks:
        is_due = tick.state[0].countdown <= 0
        if is_due and not run_tick(tick, qpos, qvel, loop.laws, loop.drives):
            return False
    for tick in loop.ticks:
        tick.state[0].countdown -= 1
    return True


@compiled
def run_hands(loop: LoopData) -> bool:
    """Do the same for hands with inverse kinematics of their own."""
    if loop.resumes[0] == 1:
        return True
    for hand in loop.hands:
        is_due = hand.state[0].countdown <= 0
        if is_due and not run_hand(hand, loop.physics, loop.laws, loop.drives):
            return False
    for hand in loop.hands:
        hand.state[0].countdown -= 1
    return True


@inner
def solve_bodies(loop: LoopData) -> bool:
    """Find contact forces and accelerations of robots; return whether all are found."""
    done = True
    for body in loop.bodies:
        done = solve_whole_body(loop.physics, body) and done
    if done:
        for body in loop.bodies:
            write_whole_body(loop.physics, body)
    return done


@inner
def add_contacts(loop: LoopData) -> bool:
    """Subtract the torques of contact forces and loads."""
    for body in loop.bodies:
        for j in range(body.torque.shape[0]):
            loop.physics.force[body.dofs[6 + j]] -= body.torque[j]
    return True


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
    loop: LoopData,
    *,
    compiled: bool = True,
    override: Callable[[], bool] | None = None,
) -> tuple[LoopData, LoopKernels, object]:
    """Return the arguments of the loop, and write the kernels' places into the laws.

    The third value has to live as long as they do, and what overrides commands too.
    Without `compiled` they are for the loop in plain Python.

    Raises:
        ConfigError: If there are more than `MOST_KINDS` kinds of laws.
    """
    laws: Any = loop.laws
    kinds = sorted({*laws["kind"].tolist()} - _NONE)
    if len(kinds) >= MOST_KINDS:
        raise ConfigError(
            f"A simulation has {len(kinds)} kinds of laws, {MOST_KINDS - 1} at most."
        )
    argument = for_kernels(loop) if compiled else for_plain_python(loop)

    def address(kernel: Any, *arguments: Any) -> Any:
        return by_address(kernel, *arguments) if compiled else plain(kernel)

    def used(kernel: Any, is_used: object) -> Any:
        return address(kernel if is_used else no_work, argument)

    def tick(kernel: Any, is_used: object) -> Any:
        if compiled or not is_used or not is_compiling():
            return used(kernel, is_used)
        return partial(_run_compiled, kernel, for_kernels(loop))

    def prepare() -> None:
        adopt(kernels, address(nothing), address(keep_direction, *of_laws))

    of_laws = as_argument(loop.physics), LawRecord.zeros()[0], loop.drives
    of_kinds = [address(no_law, *of_laws)] * MOST_KINDS
    for k, kind in enumerate(kinds, 1):
        of_kinds[k] = address(_LAWS.get(kind) or law_kernel(kind), *of_laws)
        laws["kernel"][laws["kind"] == kind] = k
    owner, is_observed = Callback(prepare), laws["observer"].any()
    kernels = LoopKernels(
        law=tuple(of_kinds),
        prepare=owner if compiled else nothing,
        keep_direction=of_kinds[0] if compiled else plain(keep_direction),
        observe_roots=used(observe_roots, is_observed and loop.bodies),
        observe=used(observe_disturbances, is_observed),
        read_sensors=used(read_sensors, loop.sources),
        run_ticks=tick(run_ticks, loop.ticks),
        run_hands=tick(run_hands, loop.hands),
        solve_bodies=used(solve_bodies, loop.bodies),
        add_contacts=used(add_contacts, loop.bodies),
        pass_commands=used(pass_commands, loop.sources),
        override=override or address(nothing),
    )
    if compiled:
        kernels = as_argument(kernels)
    return argument, kernels, owner


def _run_compiled(kernel: Any, own: LoopData, _: LoopData) -> bool:
    """Run a tick as compiled code in the loop of plain Python."""
    return kernel(own)
