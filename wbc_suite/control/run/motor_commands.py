"""From the accelerations that laws ask for to commands of the actuators.

    tau = M a + h - d - J^T f

with M and h of the whole scene, so that moving parts do not disturb each other; a are
the desired accelerations of all laws, d the estimated disturbances, f the contact
forces of robots on their feet.
"""

from wbc_suite.compiling import inner
from wbc_suite.control.ground.acceleration_limits import limit_accelerations
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.records import Drives, LawKind, LawRecord
from wbc_suite.control.ground.rigid_body import multiply_inertia
from wbc_suite.control.law.law import reference_at
from wbc_suite.control.law.osc_saturation import is_saturated
from wbc_suite.control.run.data import LoopData
from wbc_suite.control.run.kernel_table import LoopKernels

_OSC, _TORQUE, _SERVO = int(LawKind.OSC), int(LawKind.TORQUE), int(LawKind.SERVO)


@inner
def write_commands(loop: LoopData, kernels: LoopKernels) -> bool:
    """Write the commands of all actuators; runs between `mj_step1` and `mj_step2`.

    Returns:
        Whether it is done. Else the QP of a robot on its feet needs Python, after which
        this is called again.
    """
    physics, laws, drives = loop.physics, loop.laws, loop.drives
    if loop.resumes[0] == 0:
        ask_accelerations(loop, kernels)
    loop.resumes[0] = 0
    if not kernels.solve_bodies(loop):
        loop.resumes[0] = 1
        return False
    multiply_inertia(physics, physics.acceleration, physics.force)
    kernels.add_contacts(loop)
    for k in range(len(laws)):
        write_law_commands(physics, laws[k], drives)
    return True


@inner
def ask_accelerations(loop: LoopData, kernels: LoopKernels) -> None:
    """Write the accelerations that laws ask for, within the limits of their joints.

    Laws of hands build on those of the joints that carry them.
    """
    physics, laws, drives = loop.physics, loop.laws, loop.drives
    physics.acceleration[:] = 0.0
    kernels.observe_roots(loop)
    kernels.observe(loop)
    physics.acceleration[:] = 0.0
    for hands in (False, True):
        for k in range(len(laws)):
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
def write_law_commands(physics: Physics, law: LawRecord, drives: Drives) -> None:
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
