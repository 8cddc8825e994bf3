"""Compiled control laws.

Each kernel writes the joint accelerations that a law asks for; `command` then turns
all of them into actuator commands by one inverse dynamics of the whole scene. The
readable forms are the `acceleration` methods of the laws in `control.part`; a test
holds the two together.
"""

from typing import TypeAlias

from wbc_suite.compiling import compiled, compiled_inner
from wbc_suite.control.loop.balance import balance_law
from wbc_suite.control.loop.joints import base_law, joint_law, velocity_law
from wbc_suite.control.loop.motion import target_of
from wbc_suite.control.loop.observer import inertia_times_acceleration, observe
from wbc_suite.control.loop.osc import osc_law
from wbc_suite.control.loop.physics import Physics, physics_of
from wbc_suite.control.loop.stance import stance_law, take_contact_forces
from wbc_suite.control.loop.table import CompiledRecords, LawKind
from wbc_suite.control.loop.window import keep_window
from wbc_suite.typing import Indices

__all__ = ["Needed", "command", "control"]

_JOINT, _OSC = int(LawKind.JOINT), int(LawKind.OSC)
_BASE, _TORQUE, _SERVO = int(LawKind.BASE), int(LawKind.TORQUE), int(LawKind.SERVO)
_VELOCITY = int(LawKind.VELOCITY)
_STANCE, _BALANCE = int(LawKind.STANCE), int(LawKind.BALANCE)


Needed: TypeAlias = bool | None
"""True, or None to leave a kind of law out of the compiled code: numba drops what is
done only where an argument is not None. Operational space, and feet, take as long to
compile as all others."""


@compiled
def control(
    timestep: float,
    table: Indices,
    laws: CompiledRecords,
    drives: CompiledRecords,
    hands: Needed,
    feet: Needed,
) -> None:
    """Do what `command` does, for one step; see `advance` for the arguments."""
    command(physics_of(table, timestep), laws, drives, hands, feet)


@compiled_inner
def command(
    physics: Physics,
    laws: CompiledRecords,
    drives: CompiledRecords,
    hands: Needed,
    feet: Needed,
) -> None:
    """Write all actuator commands; runs between `mj_step1` and `mj_step2`.

    Each kind of law builds on what those before it ask for: hands on the joints that
    carry them, roots and legs on all that feet carry.
    """
    ask_joints(physics, laws, drives)
    if hands is not None:
        ask_hands(physics, laws, drives)
    if feet is not None:
        ask_feet(physics, laws, drives)
    inertia_times_acceleration(physics)
    if feet is not None:
        take_contact_forces(physics, laws, drives)
    write_forces(physics, laws, drives)


@compiled_inner
def ask_joints(
    physics: Physics, laws: CompiledRecords, drives: CompiledRecords
) -> None:
    """Write the accelerations that all laws of joints ask for."""
    observe(physics, laws, drives)
    physics.acceleration[:] = 0.0
    for k in range(laws.shape[0]):
        law = laws[k]
        law.since += physics.timestep
        if law.kind == _JOINT:
            joint_law(physics, law, drives)
        elif law.kind == _VELOCITY:
            velocity_law(physics, law, drives)
        elif law.kind == _BASE:
            base_law(physics, law, drives)
        if law.kind == _JOINT or law.kind == _VELOCITY or law.kind == _BASE:
            keep_window(physics, law, drives)


@compiled_inner
def ask_hands(physics: Physics, laws: CompiledRecords, drives: CompiledRecords) -> None:
    """Write the accelerations that all laws in operational space ask for."""
    for k in range(laws.shape[0]):
        if laws[k].kind == _OSC:
            osc_law(physics, laws[k], drives)


@compiled_inner
def ask_feet(physics: Physics, laws: CompiledRecords, drives: CompiledRecords) -> None:
    """Write the accelerations of roots and legs, and what feet should give."""
    for k in range(laws.shape[0]):
        if laws[k].kind == _STANCE:
            stance_law(physics, laws[k], drives)
        elif laws[k].kind == _BALANCE:
            balance_law(physics, laws[k], drives)


@compiled_inner
def write_forces(
    physics: Physics, laws: CompiledRecords, drives: CompiledRecords
) -> None:
    """Write `M a + h - d` of torque-driven joints, and the set points of servos.

    `physics.force` holds M a, less what feet carry.
    """
    for k in range(laws.shape[0]):
        law = laws[k]
        if law.kind >= _STANCE:
            continue
        for j in range(law.first, law.last):
            drive = drives[j]
            dof, command = drive.dof, 0.0
            if law.kind == _SERVO or law.kind == _TORQUE:
                command = target_of(law, drive)[0]
            else:
                command = physics.force[dof] - drive.disturbance
            if law.kind == _TORQUE:
                command += law.compensation * physics.qfrc_bias[dof]
            elif law.kind != _SERVO:
                bias = physics.qfrc_bias[dof] - physics.qfrc_passive[dof]
                command += law.compensation * bias
            drive.command = min(max(command, drive.low), drive.high)
            drive.lack = drive.command - command
            drive.asked = physics.acceleration[dof]
            drive.before = physics.qvel[dof]
            physics.ctrl[drive.ctrl] = drive.command
