"""From the accelerations that laws ask for to commands of the actuators.

    tau = M a + h - d - J^T f

with M and h of the whole scene, so that moving parts do not disturb each other; a are
the desired accelerations of all laws, d the estimated disturbances, f the contact
forces of robots on their feet.
"""

from typing import Any, TypeAlias

from wbc_suite.compiling import compiled, inner
from wbc_suite.control.dynamics.arrays import QpStage
from wbc_suite.control.law.osc_saturation import is_saturated
from wbc_suite.control.law.reference import reference_at
from wbc_suite.control.loop.acceleration_limits import limit_accelerations
from wbc_suite.control.loop.kernels import LoopKernels
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.records import CompiledRecords, LawKind
from wbc_suite.control.loop.rigid_body import multiply_inertia

_OSC, _TORQUE, _SERVO = int(LawKind.OSC), int(LawKind.TORQUE), int(LawKind.SERVO)
_WRITTEN = int(QpStage.WRITTEN)

WholeBodies: TypeAlias = Any
"""A tuple of `WholeBodyDynamics`, one for each robot on its feet; None without any."""


@compiled
def write_commands(
    physics: Physics,
    laws: CompiledRecords,
    drives: CompiledRecords,
    kernels: LoopKernels,
    bodies: WholeBodies,
) -> bool:
    """Write the commands of all actuators; runs between `mj_step1` and `mj_step2`.

    Returns:
        Whether it is done. Else the QP of a robot on its feet needs Python, after which
        this is called again.
    """
    if bodies is None:
        ask_accelerations(physics, laws, drives, kernels, bodies)
    else:
        if bodies[0].state[0].stage == _WRITTEN:  # else it goes on after Python
            ask_accelerations(physics, laws, drives, kernels, bodies)
        done = True
        for body in bodies:
            done = kernels.solve_body(physics, body) and done
        if not done:
            return False
        for body in bodies:
            kernels.write_body(physics, body)
    multiply_inertia(physics, physics.acceleration, physics.force)
    if bodies is not None:
        for body in bodies:
            for j in range(body.torque.shape[0]):
                physics.force[body.dofs[6 + j]] -= body.torque[j]
    for k in range(laws.shape[0]):
        write_law_commands(physics, laws[k], drives)
    return True


@inner
def ask_accelerations(
    physics: Physics,
    laws: CompiledRecords,
    drives: CompiledRecords,
    kernels: LoopKernels,
    bodies: WholeBodies,
) -> None:
    """Write the accelerations that laws ask for, within the limits of their joints.

    Laws of hands build on those of the joints that carry them.
    """
    kernels.observe(physics, laws, drives, bodies)
    physics.acceleration[:] = 0.0
    for hands in (False, True):
        for k in range(laws.shape[0]):
            law = laws[k]
            if not hands:
                law.since += physics.timestep
            if law.kernel > 0 and (law.kind == _OSC) == hands:
                kernels.law[law.kernel](physics, law, drives)
                if law.keep_direction > 0.0 and is_saturated(physics, law, drives):
                    kernels.prepare()
                    kernels.keep_direction(physics, law, drives)
                limit_accelerations(physics, law, drives)


@inner
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
