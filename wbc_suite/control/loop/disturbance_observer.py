"""The disturbance observer: estimate external forces on the joints."""

from typing import Any

import numpy as np

from wbc_suite.compiling import compiled, inner
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.records import CompiledRecords, LawKind
from wbc_suite.control.loop.rigid_body import multiply_inertia

_TORQUE, _SERVO = int(LawKind.TORQUE), int(LawKind.SERVO)


@compiled
def observe_disturbances(
    physics: Physics, laws: CompiledRecords, drives: CompiledRecords, bodies: Any
) -> None:
    """Update the estimated disturbances of all laws that ask for it by one step.

    The external force f on the joints, less the estimate d, is

        f - d = M (v' - a) - s

    with the change of velocity v' of the last step, the desired acceleration a, and
    what saturation took off the command, s. The estimate follows f as a low-pass of
    the first order, and stays within the actuators' limits. Gravity and Coriolis forces
    are not in it: the law compensates them.

    Source: Ohnishi, Shibata and Murakami (1996), "Motion control for advanced
    mechatronics", IEEE/ASME Transactions on Mechatronics 1(1).
    """
    is_wanted = False
    for k in range(laws.shape[0]):
        is_wanted = is_wanted or laws[k].observer > 0.0
    if not is_wanted:
        return
    physics.acceleration[:] = 0.0
    if bodies is not None:
        for body in bodies:
            for i in range(6 if body.state[0].is_free == 1 else 0):
                change = physics.qvel[body.dofs[i]] - body.last_velocity[i]
                rate = change / physics.timestep
                physics.acceleration[body.dofs[i]] = rate - body.terms.a[i]
    for k in range(laws.shape[0]):
        _write_deviation(physics, laws[k], drives)
    multiply_inertia(physics, physics.acceleration, physics.force)
    for k in range(laws.shape[0]):
        law = laws[k]
        if law.observer > 0.0 and law.kind != _TORQUE and law.kind != _SERVO:
            part = 1.0 - np.exp(-law.observer * physics.timestep)
            for j in range(law.first, law.last):
                drive = drives[j]
                change = part * (physics.force[drive.dof] - drive.saturation)
                estimate = drive.disturbance + change
                estimate = min(max(estimate, drive.command_min), drive.command_max)
                drive.disturbance = estimate


@inner
def _write_deviation(
    physics: Physics, law: CompiledRecords, drives: CompiledRecords
) -> None:
    """Write the accelerations of the last step less the desired ones."""
    if law.kind != _TORQUE and law.kind != _SERVO:
        for j in range(law.first, law.last):
            drive = drives[j]
            change = physics.qvel[drive.dof] - drive.last_velocity
            acceleration = change / physics.timestep
            physics.acceleration[drive.dof] = acceleration - drive.desired
