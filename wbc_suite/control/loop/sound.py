"""Whether a simulation is sound: numbers that MuJoCo takes, and no new warning."""

import ctypes
from enum import IntEnum

import mujoco
import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.kinematics.array_table import ArrayTable, indices, vector
from wbc_suite.typing import Indices, Vector

__all__ = ["LARGEST", "SoundField", "begins_sound", "bind_sound", "ends_sound"]

LARGEST = float(mujoco.mjMAXVAL)
"""What is larger MuJoCo calls bad, as it does NaN."""


class SoundField(IntEnum):
    """Places of arrays in a `bind_sound` table."""

    QPOS = 0
    QVEL = 1
    QFRC_APPLIED = 2
    XFRC_APPLIED = 3
    WARNINGS = 4
    """MuJoCo's (last index, count) of each warning, as one number."""
    BEFORE = 5
    """What these were when `begins_sound` looked."""


def bind_sound(data: mujoco.MjData) -> ArrayTable:
    """Return what the functions below look at."""
    first = data.warning.lastinfo.ctypes.data
    count = len(data.warning.number)
    warnings = np.ctypeslib.as_array((ctypes.c_int64 * count).from_address(first))
    return ArrayTable(
        SoundField,
        {
            SoundField.QPOS: data.qpos,
            SoundField.QVEL: data.qvel,
            SoundField.QFRC_APPLIED: data.qfrc_applied,
            SoundField.XFRC_APPLIED: data.xfrc_applied,
            SoundField.WARNINGS: warnings,
            SoundField.BEFORE: warnings.copy(),
        },
    )


@compiled
def begins_sound(sound: Indices) -> bool:
    """Note the warnings so far; tell whether all numbers are usable."""
    warnings, before = indices(sound, 4), indices(sound, 5)
    for k in range(before.shape[0]):
        before[k] = warnings[k]
    return all_usable(sound)


@compiled
def ends_sound(sound: Indices) -> bool:
    """Tell whether there is no new warning, and all numbers are usable."""
    warnings, before = indices(sound, 4), indices(sound, 5)
    for k in range(before.shape[0]):
        if warnings[k] != before[k]:
            return False
    return all_usable(sound)


@compiled
def all_usable(sound: Indices) -> bool:
    """Tell whether MuJoCo takes all numbers: finite, none too large."""
    return (
        is_usable(vector(sound, 0))
        and is_usable(vector(sound, 1))
        and is_usable(vector(sound, 2))
        and is_usable(vector(sound, 3))
    )


@compiled
def is_usable(values: Vector) -> bool:
    """Tell whether MuJoCo takes all numbers of an array."""
    usable = True
    for value in values:
        usable &= abs(value) <= LARGEST  # not so for NaN
    return usable
