"""The disturbance observer: estimate external forces on the joints."""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.records import Drives, LawKind, LawRecord
from wbc_suite.control.ground.rigid_body import multiply_inertia
from wbc_suite.control.run.data import LoopData

_TORQUE, _SERVO = int(LawKind.TORQUE), int(LawKind.SERVO)


@inner
def observe_disturbances(loop: LoopData) -> bool:
    """Update the estimated disturbances of all laws that ask for it by one step.

    The external force f on the joints, less the estimate d, is

        f - d = M (v' - a) - s

    with the change of velocity v' of the last step, the desired acceleration a, and
    what saturation took off the command, s. The estimate follows f as a low-pass of
    the first order, and stays within the actuators' limits. Gravity and Coriolis forces
    are not in it: the law compensates them. `observe_roots` has run before.

    Source: Ohnishi, Shibata and Murakami (1996), "Motion control for advanced
    mechatronics", IEEE/ASME Transactions on Mechatronics 1(1).
    """
    physics, laws, drives = loop.physics, loop.laws, loop.drives
    for k in range(len(laws)):
        _write_deviation(physics, laws[k], drives)
    multiply_inertia(physics, physics.acceleration, physics.force)
    for k in range(len(laws)):
        law = laws[k]
        if law.observer > 0.0 and law.kind != _TORQUE and law.kind != _SERVO:
            part = 1.0 - np.exp(-law.observer * physics.timestep)
            for j in range(law.first, law.last):
                drive = drives[j]
                change = part * (physics.force[drive.dof] - drive.saturation)
                estimate = drive.disturbance + change
                estimate = min(max(estimate, drive.command_min), drive.command_max)
                drive.disturbance = estimate
    return True


@inner
def observe_roots(loop: LoopData) -> bool:
    """Write by how much the accelerations of free roots differ from the planned."""
    physics = loop.physics
    for body in loop.bodies:
        for i in range(6 if body.state[0].is_free == 1 else 0):
            change = physics.qvel[body.dofs[i]] - body.last_velocity[i]
            rate = change / physics.timestep
            physics.acceleration[body.dofs[i]] = rate - body.terms.a[i]
    return True


@inner
def _write_deviation(physics: Physics, law: LawRecord, drives: Drives) -> None:
    """Write the accelerations of the last step less the desired ones."""
    if law.kind != _TORQUE and law.kind != _SERVO:
        for j in range(law.first, law.last):
            drive = drives[j]
            change = physics.qvel[drive.dof] - drive.last_velocity
            acceleration = change / physics.timestep
            physics.acceleration[drive.dof] = acceleration - drive.desired
