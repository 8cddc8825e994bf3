"""MuJoCo's functions and the addresses of its structures, for compiled code.

Numba calls a C function by its symbol, and passes models and data as addresses. MuJoCo
documents neither for Python, so this is the one module that reaches past the package's
documentation: all others use its arrays and functions.
"""

from pathlib import Path

import llvmlite.binding
import mujoco
from numba import types

from wbc_suite.compiling import external, inner
from wbc_suite.typing import Vector

_MODEL_AND_DATA = types.void(types.intp, types.intp)

_LIBRARY = next(Path(mujoco.__file__).parent.glob("libmujoco*"))
llvmlite.binding.load_library_permanently(str(_LIBRARY))

mj_step1 = external(mujoco.mj_step1, _MODEL_AND_DATA)
mj_step2 = external(mujoco.mj_step2, _MODEL_AND_DATA)
mj_kinematics = external(mujoco.mj_kinematics, _MODEL_AND_DATA)
mj_comPos = external(mujoco.mj_comPos, _MODEL_AND_DATA)
mj_geomDistance = external(
    mujoco.mj_geomDistance,
    types.double(
        types.intp, types.intp, types.intc, types.intc, types.double, types.intp
    ),
)


def addresses(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[int, int]:
    """Return the addresses of a model and its data, valid as long as both live."""
    return model._address, data._address


@inner
def geom_distance(
    model: int, data: int, first: int, second: int, farthest: float, segment: Vector
) -> float:
    """Return the distance of two geoms, m, at most `farthest`; below zero inside.

    The segment, shape (6,), gets the nearest points of both, in the world, m.
    """
    return mj_geomDistance(model, data, first, second, farthest, segment.ctypes.data)
