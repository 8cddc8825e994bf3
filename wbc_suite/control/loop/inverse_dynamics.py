"""From the accelerations that laws ask for to commands of the actuators.

    tau = M a + h - d - J^T f

with M and h of the whole scene, so that moving parts do not disturb each other; a are
the desired accelerations of all laws, d the estimated disturbances, f the contact
forces of robots on their feet.
"""

from typing import Any, TypeAlias

from wbc_suite.compiling import compiled, compiled_each_time
from wbc_suite.control.dynamics.arrays import Stage
from wbc_suite.control.dynamics.solve_tick import solve_whole_body, write_whole_body
from wbc_suite.control.law.custom import custom_kernel
from wbc_suite.control.law.joint_laws import base_law, joint_law, velocity_law
from wbc_suite.control.law.osc import osc_law
from wbc_suite.control.law.reference import reference_at
from wbc_suite.control.loop.acceleration_limits import limit_accelerations
from wbc_suite.control.loop.disturbance_observer import observe_disturbances
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.records import CompiledRecords, LawKind, Records
from wbc_suite.control.loop.rigid_body import multiply_inertia

_JOINT, _OSC = int(LawKind.JOINT), int(LawKind.OSC)
_BASE, _VELOCITY = int(LawKind.BASE), int(LawKind.VELOCITY)
_TORQUE, _SERVO = int(LawKind.TORQUE), int(LawKind.SERVO)
_STATED = int(Stage.STATED)

CustomLaw: TypeAlias = Any
"""One kernel for all laws of users, see `control.law.custom`; None without any."""

WholeBodies: TypeAlias = Any
"""A tuple of `WholeBodyDynamics`, one for each robot on its feet; None without any."""

Needed: TypeAlias = bool | None
"""True, or None to leave a group of laws out of the machine code: numba drops what
depends on an argument that is None, which halves the time to compile."""


@compiled_each_time
def write_commands(
    physics: Physics,
    laws: CompiledRecords,
    drives: CompiledRecords,
    hands: Needed,
    custom_law: CustomLaw,
    bodies: WholeBodies,
) -> bool:
    """Write the commands of all actuators; runs between `mj_step1` and `mj_step2`.

    Returns:
        Whether it is done. Else the QP of a robot on its feet needs Python, after which
        this is called again.
    """
    if bodies is None:
        ask_accelerations(physics, laws, drives, hands, custom_law, bodies)
    else:
        if bodies[0].state[0].stage == _STATED:  # else it goes on after Python
            ask_accelerations(physics, laws, drives, hands, custom_law, bodies)
        if not solve_bodies(physics, bodies):
            return False
    multiply_inertia(physics, physics.acceleration, physics.force)
    if bodies is not None:
        for body in bodies:
            for j in range(body.torque.shape[0]):
                physics.force[body.dofs[6 + j]] -= body.torque[j]
    for k in range(laws.shape[0]):
        write_law_commands(physics, laws[k], drives)
    return True


@compiled
def solve_bodies(physics: Physics, bodies: WholeBodies) -> bool:
    """Write accelerations and contact forces of robots on their feet, if all solve."""
    done = True
    for body in bodies:
        done = solve_whole_body(physics, body) and done
    if done:
        for body in bodies:
            write_whole_body(physics, body)
    return done


@compiled_each_time
def ask_accelerations(
    physics: Physics,
    laws: CompiledRecords,
    drives: CompiledRecords,
    hands: Needed,
    custom_law: CustomLaw,
    bodies: WholeBodies,
) -> None:
    """Write the accelerations that the laws of all joints ask for.

    Laws of hands build on those of the joints that carry them.
    """
    observe_disturbances(physics, laws, drives, bodies)
    physics.acceleration[:] = 0.0
    for k in range(laws.shape[0]):
        laws[k].since += physics.timestep
        joint_space_law(physics, laws[k], drives)
        if custom_law is not None:
            custom_law(physics, laws[k], drives)
    if hands is not None:
        for k in range(laws.shape[0]):
            if laws[k].kind == _OSC:
                osc_law(physics, laws[k], drives)


@compiled
def joint_space_law(
    physics: Physics, law: CompiledRecords, drives: CompiledRecords
) -> None:
    """Write the accelerations of a law of joints, within the joints' limits."""
    if law.kind == _JOINT:
        joint_law(physics, law, drives)
    elif law.kind == _VELOCITY:
        velocity_law(physics, law, drives)
    elif law.kind == _BASE:
        base_law(physics, law, drives)
    else:
        return
    limit_accelerations(physics, law, drives)


@compiled
def write_law_commands(
    physics: Physics, law: CompiledRecords, drives: CompiledRecords
) -> None:
    """Write `M a + h - d - J^T f` within the limits of actuators, or setpoints.

    `physics.force` holds `M a - J^T f`. A torque law adds its torques to Coriolis,
    centrifugal and gravity forces, less what `gravcomp` of the model cancels already;
    other passive forces stay. Actuators that are servos get the setpoint at which they
    exert that force.
    """
    for j in range(law.first, law.last):
        drive = drives[j]
        dof = drive.dof
        bias = law.compensation * physics.qfrc_bias[dof]
        if law.kind == _SERVO:
            command = reference_at(law, drive)[0]
        elif law.kind == _TORQUE:
            bias -= law.compensation * physics.qfrc_gravcomp[dof]
            command = reference_at(law, drive)[0] + bias
        else:
            bias -= law.compensation * physics.qfrc_passive[dof]
            force = physics.force[dof]
            force += drive.implicit_inertia * physics.acceleration[dof]
            command = force + bias - drive.disturbance
        drive.command = min(max(command, drive.command_min), drive.command_max)
        drive.saturation = drive.command - command
        drive.desired = physics.acceleration[dof]
        drive.last_velocity = physics.qvel[dof]
        servo = drive.stiffness * physics.qpos[drive.qpos]
        servo += drive.damping * physics.qvel[dof]
        physics.ctrl[drive.ctrl] = (drive.command + servo) / drive.gain


def needed_kernels(laws: Records) -> tuple[Needed, CustomLaw]:
    """Return `hands` and `custom_law` of `write_commands` for a table of laws."""
    kinds = laws["kind"]
    return bool((kinds == LawKind.OSC).any()) or None, custom_kernel(kinds)
