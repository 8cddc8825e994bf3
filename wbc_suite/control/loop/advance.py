"""The compiled control loop: physics and laws, n steps in one call."""

from wbc_suite.compiling import compiled
from wbc_suite.control.loop.kernels import Needed, command
from wbc_suite.control.loop.physics import (
    flags_of,
    let_sense,
    mj_comPos,
    mj_kinematics,
    mj_step1,
    mj_step2,
    physics_of,
    start_profiler,
    stop_profiler,
)
from wbc_suite.control.loop.sound import begins_sound, ends_sound
from wbc_suite.control.loop.table import CompiledRecords, LawKind, Records
from wbc_suite.typing import Indices

__all__ = ["advance", "needed"]


def needed(laws: Records) -> tuple[Needed, Needed]:
    """Return which laws of hands and of feet `advance` is to know: those of a table."""
    hands, feet = laws["kind"] == LawKind.OSC, laws["kind"] >= LawKind.STANCE
    return bool(hands.any()) or None, bool(feet.any()) or None


@compiled
def advance(
    model: int,
    data: int,
    timestep: float,
    table: Indices,
    sound: Indices,
    laws: CompiledRecords,
    drives: CompiledRecords,
    hands: Needed,
    feet: Needed,
    steps: int,
) -> bool:
    """Advance physics under all laws; holds no lock, so threads run side by side.

    Positions of bodies and sites are brought up to date at the end: MuJoCo's own step
    leaves them one step behind the joints. Sensors are read in the last step: nobody
    sees what they say in others. Nor does anybody see how long MuJoCo's parts take.

    Args:
        model: Address of the model.
        data: Address of its data.
        timestep: Duration of a step, s.
        table: Where their arrays are, see `physics_table`.
        sound: Where what may be broken is, see `bind_sound`.
        laws: `LAW` records.
        drives: `DRIVE` records.
        hands: Whether a law is in operational space, see `needed`.
        feet: Whether a law is of feet.
        steps: How many steps of physics.

    Returns:
        Whether all numbers were and are usable, and MuJoCo did not warn. Where they are
        not to begin with, there is no step.
    """
    if not begins_sound(sound):
        return False
    physics = physics_of(table, timestep)
    flags, clock = flags_of(table), stop_profiler(table)
    for k in range(steps):
        let_sense(table, flags, k == steps - 1)
        mj_step1(model, data)
        command(physics, laws, drives, hands, feet)
        mj_step2(model, data)
    mj_kinematics(model, data)
    mj_comPos(model, data)
    start_profiler(table, clock)
    return ends_sound(sound)
