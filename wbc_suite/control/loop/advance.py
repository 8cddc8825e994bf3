"""The compiled control loop: physics and laws, n steps in one call."""

from collections.abc import Callable

from wbc_suite.compiling import compiled
from wbc_suite.control.loop.kernels import command, command_joints
from wbc_suite.control.loop.physics import (
    flags_of,
    let_sense,
    mj_comPos,
    mj_kinematics,
    mj_step1,
    mj_step2,
    physics_of,
)
from wbc_suite.control.loop.sound import begins_sound, ends_sound
from wbc_suite.control.loop.standing import command_standing
from wbc_suite.control.loop.table import CompiledRecords, LawKind, Records
from wbc_suite.typing import Indices

__all__ = ["advance", "advance_joints", "advance_standing", "loop_of"]


def loop_of(laws: Records) -> Callable[..., bool]:
    """Return the loop that knows these laws and takes the least time to compile."""
    kinds = laws["kind"]
    if (kinds >= LawKind.STANCE).any():
        return advance_standing
    return advance if (kinds == LawKind.OSC).any() else advance_joints


@compiled
def advance(
    model: int,
    data: int,
    timestep: float,
    table: Indices,
    sound: Indices,
    laws: CompiledRecords,
    drives: CompiledRecords,
    steps: int,
) -> bool:
    """Advance physics under all laws; holds no lock, so threads run side by side.

    Positions of bodies and sites are brought up to date at the end: MuJoCo's own step
    leaves them one step behind the joints. Sensors are read in the last step: nobody
    sees what they say in others.

    Args:
        model: Address of the model.
        data: Address of its data.
        timestep: Duration of a step, s.
        table: Where their arrays are, see `physics_table`.
        sound: Where what may be broken is, see `bind_sound`.
        laws: `LAW` records.
        drives: `DRIVE` records.
        steps: How many steps of physics.

    Returns:
        Whether all numbers were and are usable, and MuJoCo did not warn. Where they are
        not to begin with, there is no step.
    """
    if not begins_sound(sound):
        return False
    physics = physics_of(table, timestep)
    flags = flags_of(table)
    for k in range(steps):
        let_sense(table, flags, k == steps - 1)
        mj_step1(model, data)
        command(physics, laws, drives)
        mj_step2(model, data)
    mj_kinematics(model, data)
    mj_comPos(model, data)
    return ends_sound(sound)


@compiled
def advance_standing(
    model: int,
    data: int,
    timestep: float,
    table: Indices,
    sound: Indices,
    laws: CompiledRecords,
    drives: CompiledRecords,
    steps: int,
) -> bool:
    """Do what `advance` does, with laws of feet among the others."""
    if not begins_sound(sound):
        return False
    physics = physics_of(table, timestep)
    flags = flags_of(table)
    for k in range(steps):
        let_sense(table, flags, k == steps - 1)
        mj_step1(model, data)
        command_standing(physics, laws, drives)
        mj_step2(model, data)
    mj_kinematics(model, data)
    mj_comPos(model, data)
    return ends_sound(sound)


@compiled
def advance_joints(
    model: int,
    data: int,
    timestep: float,
    table: Indices,
    sound: Indices,
    laws: CompiledRecords,
    drives: CompiledRecords,
    steps: int,
) -> bool:
    """Do what `advance` does, without laws in operational space."""
    if not begins_sound(sound):
        return False
    physics = physics_of(table, timestep)
    flags = flags_of(table)
    for k in range(steps):
        let_sense(table, flags, k == steps - 1)
        mj_step1(model, data)
        command_joints(physics, laws, drives)
        mj_step2(model, data)
    mj_kinematics(model, data)
    mj_comPos(model, data)
    return ends_sound(sound)
