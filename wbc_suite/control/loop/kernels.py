"""Compiled control laws.

Each kernel writes the joint accelerations that a law asks for; `write_commands` then
turns all of them into actuator commands by one inverse dynamics of the whole scene. The
readable forms are the `acceleration` methods of the laws in `control.part`; a test
holds the two together.
"""

from wbc_suite.compiling import compiled, compiled_inner
from wbc_suite.control.loop.joints import base_law, joint_law, velocity_law
from wbc_suite.control.loop.motion import target_of
from wbc_suite.control.loop.observer import inertia_times_acceleration, observe
from wbc_suite.control.loop.osc import osc_law
from wbc_suite.control.loop.physics import Physics, physics_of
from wbc_suite.control.loop.table import CompiledRecords, LawKind
from wbc_suite.control.loop.window import keep_window
from wbc_suite.typing import Indices

__all__ = ["ask", "ask_joints", "command", "command_joints", "control"]
__all__ += ["write_commands", "write_forces"]

_JOINT, _OSC = int(LawKind.JOINT), int(LawKind.OSC)
_BASE, _TORQUE, _SERVO = int(LawKind.BASE), int(LawKind.TORQUE), int(LawKind.SERVO)
_VELOCITY, _STANCE = int(LawKind.VELOCITY), int(LawKind.STANCE)


@compiled
def control(
    timestep: float, table: Indices, laws: CompiledRecords, drives: CompiledRecords
) -> None:
    """Do what `command` does, for one step; see `advance` for the arguments."""
    command(physics_of(table, timestep), laws, drives)


@compiled_inner
def command(physics: Physics, laws: CompiledRecords, drives: CompiledRecords) -> None:
    """Write all actuator commands; runs between `mj_step1` and `mj_step2`."""
    ask(physics, laws, drives)
    write_commands(physics, laws, drives)


@compiled_inner
def command_joints(
    physics: Physics, laws: CompiledRecords, drives: CompiledRecords
) -> None:
    """Do what `command` does where no law is in operational space."""
    ask_joints(physics, laws, drives)
    write_commands(physics, laws, drives)


@compiled_inner
def ask(physics: Physics, laws: CompiledRecords, drives: CompiledRecords) -> None:
    """Write the accelerations that all laws of joints and hands ask for."""
    ask_joints(physics, laws, drives)
    for k in range(laws.shape[0]):  # after joints that carry the arms
        if laws[k].kind == _OSC:
            osc_law(physics, laws[k], drives)


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
def write_commands(
    physics: Physics, laws: CompiledRecords, drives: CompiledRecords
) -> None:
    """Write `M a + h - d` of torque-driven joints, and the set points of servos."""
    inertia_times_acceleration(physics)
    write_forces(physics, laws, drives)


@compiled_inner
def write_forces(
    physics: Physics, laws: CompiledRecords, drives: CompiledRecords
) -> None:
    """Write the commands once `physics.force` holds M a, less what feet carry."""
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
