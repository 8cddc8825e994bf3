"""The compiled control loop: physics and laws, n steps in one call."""

import numpy as np

from wbc_suite.compiling import compiled_unlocked
from wbc_suite.control.loop.haste import (
    begin_haste,
    end_haste,
    let_fixed_rest,
    may_haste,
    may_hide,
    show_bodies,
    start_profiler,
    stop_profiler,
)
from wbc_suite.control.loop.kernels import Needed, command
from wbc_suite.control.loop.neighbours import SKIN, hide_far_bodies, way
from wbc_suite.control.loop.physics import (
    mj_comPos,
    mj_kinematics,
    mj_step1,
    mj_step2,
    physics_of,
)
from wbc_suite.control.loop.sound import begins_sound, ends_sound
from wbc_suite.control.loop.table import CompiledRecords, LawKind, Records
from wbc_suite.typing import Indices

__all__ = ["advance", "needed"]

WORTH = 8
"""Steps that must be left for it to pay to look which bodies are far."""


def needed(laws: Records) -> tuple[Needed, Needed]:
    """Return which laws of hands and of feet `advance` is to know: those of a table."""
    hands, feet = laws["kind"] == LawKind.OSC, laws["kind"] >= LawKind.STANCE
    return bool(hands.any()) or None, bool(feet.any()) or None


@compiled_unlocked
def advance(
    model: int,
    data: int,
    timestep: float,
    table: Indices,
    haste: Indices,
    sound: Indices,
    laws: CompiledRecords,
    drives: CompiledRecords,
    hands: Needed,
    feet: Needed,
    steps: int,
    seen: bool,
) -> bool:
    """Advance physics under all laws; holds no lock, so threads run side by side.

    Positions of bodies and sites are brought up to date at the end: MuJoCo's own step
    leaves them one step behind the joints. All steps are hasty but one that somebody
    looks at, the last: see `haste` and `neighbours`.

    Args:
        model: Address of the model.
        data: Address of its data.
        timestep: Duration of a step, s.
        table: Where their arrays are, see `physics_table`.
        haste: Where is what a step may leave out, see `bind_haste`.
        sound: Where what may be broken is, see `bind_sound`.
        laws: `LAW` records.
        drives: `DRIVE` records.
        hands: Whether a law is in operational space, see `needed`.
        feet: Whether a law is of feet.
        steps: How many steps of physics.
        seen: Whether somebody looks at more than joints afterwards: at poses, sensors.

    Returns:
        Whether all numbers were and are usable, and MuJoCo did not warn. Where they are
        not to begin with, there is no step.
    """
    if not begins_sound(sound):
        return False
    physics = physics_of(table, timestep)
    clock = stop_profiler(haste)
    hasty, hides = (steps > 1 or not seen) and may_haste(haste), False
    moved = np.inf  # by how much two geoms may be nearer than when bodies were hidden
    if hasty:
        begin_haste(haste)
    for k in range(steps):
        if hasty and seen and k == steps - 1:
            end_haste(haste)
        elif hasty and k > 0:
            let_fixed_rest(haste)
            if hides and moved > SKIN:
                show_bodies(haste)
        mj_step1(model, data)
        command(physics, laws, drives, hands, feet)
        if hasty and moved > SKIN and steps - k > WORTH and may_hide(haste):
            hide_far_bodies(haste)
            moved, hides = 0.0, True
        mj_step2(model, data)
        moved += way(haste, timestep)
    if seen:
        mj_kinematics(model, data)
        mj_comPos(model, data)
    elif hasty:
        end_haste(haste)
    start_profiler(haste, clock)
    return ends_sound(sound)
