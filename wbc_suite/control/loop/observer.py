"""What pushes on the joints: the disturbance observer, and M times accelerations."""

import numpy as np

from wbc_suite.compiling import compiled_inner, inlined
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.table import CompiledRecords, LawKind

__all__ = ["inertia_times_acceleration", "observe"]

_TORQUE, _SERVO = int(LawKind.TORQUE), int(LawKind.SERVO)
_STANCE = int(LawKind.STANCE)


@compiled_inner
def observe(physics: Physics, laws: CompiledRecords, drives: CompiledRecords) -> None:
    """Move the disturbances of `control.part.law.observe` on by one step."""
    wanted = False
    for k in range(laws.shape[0]):
        wanted = wanted or laws[k].observer > 0.0
    if not wanted:
        return
    dt = physics.timestep
    physics.acceleration[:] = 0.0
    for k in range(laws.shape[0]):
        law = laws[k]
        if law.kind >= _STANCE:
            write_root_deviation(physics, law)
        if law.kind == _TORQUE or law.kind == _SERVO or law.kind >= _STANCE:
            continue
        for j in range(law.first, law.last):
            drive = drives[j]
            change = (physics.qvel[drive.dof] - drive.before) / dt
            physics.acceleration[drive.dof] = change - drive.asked
    inertia_times_acceleration(physics)
    for k in range(laws.shape[0]):
        law = laws[k]
        if law.observer > 0.0 and law.kind != _TORQUE and law.kind != _SERVO:
            part = 1.0 - np.exp(-law.observer * dt)
            for j in range(law.first, law.last):
                drive = drives[j]
                news = physics.force[drive.dof] - drive.lack
                estimate = drive.disturbance + part * news
                drive.disturbance = min(max(estimate, drive.low), drive.high)


@inlined
def write_root_deviation(physics: Physics, law: CompiledRecords) -> None:
    """Write by how much a free root accelerated more than it was asked to."""
    stance = law.stance
    for i in range(6):
        change = (physics.qvel[stance.dof + i] - stance.before[i]) / physics.timestep
        physics.acceleration[stance.dof + i] = change - stance.asked[i]


@inlined
def inertia_times_acceleration(physics: Physics) -> None:
    """Write M times the accelerations into the forces of the scratch, shape (nv,)."""
    a, force = physics.acceleration, physics.force
    force[:] = 0.0
    for i in range(a.shape[0]):
        first = physics.M_rowadr[i]
        last = first + physics.M_rownnz[i] - 1  # the diagonal
        total = physics.M[last] * a[i]
        for k in range(first, last):
            column = physics.M_colind[k]
            total += physics.M[k] * a[column]
            force[column] += physics.M[k] * a[i]
        force[i] += total
