"""Check that a simulation's state is usable: finite numbers, and no new warning."""

from typing import NamedTuple

import mujoco
import numpy as np

from wbc_suite.compiling import compiled, inner, struct
from wbc_suite.typing import Indices, Vector

LARGEST = float(mujoco.mjMAXVAL)
"""MuJoCo calls larger numbers bad, as it does NaN."""
FASTEST = 1e5
"""Greatest speed of a joint, m/s or rad/s; nothing that moves so is simulated well."""


@struct
class CheckedState(NamedTuple):
    """Arrays that MuJoCo checks in each step, and its counts of warnings."""

    qpos: Vector
    qvel: Vector
    qfrc_applied: Vector
    xfrc_applied: Vector
    warnings: Indices
    """How often each warning was raised."""
    warnings_before: Indices
    """The same at the last `check_before`."""


def checked_state(data: mujoco.MjData) -> CheckedState:
    """Return the view of a simulation's data that the checks read."""
    warnings = data.warning.number
    return CheckedState(
        qpos=data.qpos,
        qvel=data.qvel,
        qfrc_applied=data.qfrc_applied,
        xfrc_applied=data.xfrc_applied.reshape(-1),
        warnings=warnings,
        warnings_before=np.array(warnings),
    )


@compiled
def check_before(state: CheckedState) -> bool:
    """Note the warnings so far; return whether all numbers are usable."""
    for i in range(state.warnings.shape[0]):
        state.warnings_before[i] = state.warnings[i]
    return _all_usable(state)


@compiled
def check_after(state: CheckedState) -> bool:
    """Return whether there is no new warning, and all numbers are usable."""
    for k in range(state.warnings.shape[0]):
        if state.warnings[k] != state.warnings_before[k]:
            return False
    return _all_usable(state)


@inner
def _all_usable(state: CheckedState) -> bool:
    if not (is_usable(state.qpos, LARGEST) and is_usable(state.qvel, FASTEST)):
        return False
    forces = is_usable(state.qfrc_applied, LARGEST)
    return forces and is_usable(state.xfrc_applied, LARGEST)


@compiled
def is_usable(values: Vector, most: float) -> bool:
    """Return whether all numbers are finite and not larger than `most`."""
    usable = True
    for value in values:
        usable &= abs(value) <= most  # not so for NaN
    return usable
