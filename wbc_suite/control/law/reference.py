"""References of joints, as kernels read and write them."""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.control.loop.records import CompiledRecords
from wbc_suite.typing import Matrix


@inner
def reference_at(
    law: CompiledRecords, drive: CompiledRecords
) -> tuple[float, float, float]:
    """Return position, velocity and acceleration of a drive's reference now."""
    s = min(law.since, law.duration)
    v, a, j = drive.velocity, drive.acceleration, drive.jerk
    position = drive.position + s * (v + s * (0.5 * a + s / 6.0 * j))
    if law.since > law.duration:
        return position, 0.0, 0.0
    return position, v + s * (a + 0.5 * s * j), a + s * j


@inner
def set_reference(
    record: CompiledRecords, drives: CompiledRecords, motion: Matrix
) -> None:
    """Set the reference of a law's record, shape (1,), and drives; see `Law.aim`.

    The motion has positions, velocities, accelerations and jerks, shape (4, n).
    """
    for j in range(drives.shape[0]):
        drive = drives[j]
        drive.position, drive.velocity = motion[0, j], motion[1, j]
        drive.acceleration, drive.jerk = motion[2, j], motion[3, j]
    record[0].since, record[0].duration = 0.0, np.inf
