"""Check that a simulation's state is usable: finite numbers, and no new warning."""

from typing import NamedTuple

import mujoco
import numpy as np

from wbc_suite.compiling import compiled, inner, struct
from wbc_suite.typing import Indices, Matrix, Vector

LARGEST = float(mujoco.mjMAXVAL)
"""MuJoCo calls larger numbers bad, as it does NaN."""
FASTEST = 1e5
"""Greatest speed of a joint, m/s or rad/s; nothing that moves so is simulated well."""


@struct
class CheckedState(NamedTuple):
    """Arrays that MuJoCo checks in each step, its warnings, and what it does not."""

    qpos: Vector
    qvel: Vector
    qfrc_applied: Vector
    xfrc_applied: Vector
    warnings: Indices
    """How often each warning was raised."""
    warnings_before: Indices
    """The same at the last `check_before`."""
    gravity: Vector
    masses: Vector
    inertias: Vector
    sizes: Vector
    ranges: Matrix
    """Of joints, shape (n, 2)."""


def checked_state(model: mujoco.MjModel, data: mujoco.MjData) -> CheckedState:
    """Return the view of a simulation that the checks read."""
    warnings = data.warning.number
    return CheckedState(
        qpos=data.qpos,
        qvel=data.qvel,
        qfrc_applied=data.qfrc_applied,
        xfrc_applied=data.xfrc_applied.reshape(-1),
        warnings=warnings,
        warnings_before=np.array(warnings),
        gravity=model.opt.gravity,
        masses=model.body_mass,
        inertias=model.body_inertia.reshape(-1),
        sizes=model.geom_size.reshape(-1),
        ranges=model.jnt_range,
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
    if not (forces and is_usable(state.xfrc_applied, LARGEST)):
        return False
    positive = _is_positive(state.masses) and _is_positive(state.inertias)
    if not (positive and _is_positive(state.sizes)):
        return False
    for i in range(state.ranges.shape[0]):
        if not state.ranges[i, 0] <= state.ranges[i, 1]:
            return False
    return is_usable(state.gravity, LARGEST)


@inner
def _is_positive(values: Vector) -> bool:
    """Return whether all numbers are 0 or greater."""
    positive = True
    for value in values:
        positive &= value >= 0.0  # not so for NaN
    return positive


@inner
def is_usable(values: Vector, most: float) -> bool:
    """Return whether all numbers are finite and not larger than `most`."""
    usable = True
    for value in values:
        usable &= abs(value) <= most  # not so for NaN
    return usable
