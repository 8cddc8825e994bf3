"""What MuJoCo's steps leave out while nobody looks: all of an action but the last.

States, contacts and what is read after the last step are the same to the bit.
"""

import ctypes
from enum import IntEnum
from pathlib import Path
from typing import Any

import llvmlite.binding
import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.compiling import compiled
from wbc_suite.kinematics.array_table import ArrayTable, indices, short_indices
from wbc_suite.typing import Indices

__all__ = ["Haste", "begin_haste", "bind_haste", "end_haste", "let_fixed_rest"]
__all__ += [
    "load_mujoco",
    "may_haste",
    "may_hide",
    "show_bodies",
    "start_profiler",
    "stop_profiler",
]


def load_mujoco() -> None:
    """Let compiled code find MuJoCo's functions by their names."""
    library = next(Path(mujoco.__file__).parent.glob("libmujoco*"))
    llvmlite.binding.load_library_permanently(str(library))


load_mujoco()
_PROFILER_CLOCK = llvmlite.binding.address_of_symbol("mjcb_time")
_NO_SENSORS = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
_PARENTS = int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
_MARGINS = int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
_SLEEP = int(mujoco.mjtEnableBit.mjENBL_SLEEP)
_NEVER = int(mujoco.mjtSleepPolicy.mjSLEEP_NEVER)
_GIVEN = 6


class Haste(IntEnum):
    """Places of arrays in a `bind_haste` table: MuJoCo's own, and the loop's notes."""

    MAY = 0
    """Whether there may be haste, whether far bodies may be hidden; see `_may`."""
    PROFILER = 1
    """MuJoCo's clock."""
    FLAGS = 2
    """What the model switches off and on. This and the next five are changed."""
    BODY_GEOMADR = 3
    BODY_GEOMNUM = 4
    BODY_CONTYPE = 5
    BODY_CONAFFINITY = 6
    TREE_SLEEP_POLICY = 7
    GIVEN_FLAGS = 8
    """What these six were before."""
    GIVEN_GEOMADR = 9
    GIVEN_GEOMNUM = 10
    GIVEN_CONTYPE = 11
    GIVEN_CONAFFINITY = 12
    GIVEN_POLICY = 13
    GEOM_CONTYPE = 14
    GEOM_CONAFFINITY = 15
    PAIRS = 16
    """Bodies that could collide by where they hang, one after the other."""
    BODY_PARENTID = 17
    BODY_WELDID = 18
    BODY_JNTADR = 19
    BODY_JNTNUM = 20
    JNT_TYPE = 21
    JNT_QPOSADR = 22
    JNT_DOFADR = 23
    GEOM_TYPE = 24
    GEOM_RBOUND = 25
    GEOM_MARGIN = 26
    GEOM_GAP = 27
    GEOM_AABB = 28
    GEOM_POS = 29
    BODY_POS = 30
    JNT_POS = 31
    GEOM_XPOS = 32
    GEOM_XMAT = 33
    QPOS = 34
    QPOS0 = 35
    QVEL = 36
    LOW = 37
    """Corners of boxes around each body's geoms, shape (nbody, 3): scratch."""
    HIGH = 38
    REACH = 39
    """How far a body's geoms, and those of what hangs on it, are from it: scratch."""
    LEVERS = 40
    """How far a unit of each degree of freedom moves a geom at most, shape (nv,)."""
    NEAR = 41
    """Whether something is near each geom: scratch."""
    PAUSE = 42
    """For how many actions nobody looks which bodies are far."""


def bind_haste(model: mujoco.MjModel, data: mujoco.MjData) -> ArrayTable:
    """Return what the functions here, and those of `neighbours`, work on."""
    nbody = model.nbody
    arrays: dict[str, NDArray[Any]] = {
        "MAY": np.array(_may(model), dtype=np.int64),
        "FLAGS": _flags(model.opt),
        "PROFILER": _word_at(_PROFILER_CLOCK),
        "GIVEN_FLAGS": np.zeros(2, dtype=np.int32),
        "PAUSE": np.zeros(1, dtype=np.int64),
        "PAIRS": _pairs(model),
        "LOW": np.zeros((nbody, 3)),
        "HIGH": np.zeros((nbody, 3)),
        "REACH": np.zeros(nbody),
        "LEVERS": np.zeros(model.nv),
    }
    for name in ("GIVEN_GEOMADR", "GIVEN_GEOMNUM", "GIVEN_CONTYPE"):
        arrays[name] = np.zeros(nbody, dtype=np.int32)
    arrays["GIVEN_CONAFFINITY"] = np.zeros(nbody, dtype=np.int32)
    arrays["NEAR"] = np.zeros(model.ngeom, dtype=np.int32)
    arrays["GIVEN_POLICY"] = np.zeros(model.ntree, dtype=np.int32)
    for field in Haste:
        if field.name not in arrays:
            owner = data if hasattr(data, field.name.lower()) else model
            arrays[field.name] = getattr(owner, field.name.lower())
    return ArrayTable(Haste, {field: arrays[field.name] for field in Haste})


def _may(model: mujoco.MjModel) -> tuple[bool, bool, int]:
    """Return whether there may be haste, whether far bodies may be hidden, and a flag.

    Sensors that remember are read in every step; fluids, tendons, plugins and pairs
    that somebody wrote down ask for geoms that do not collide. What is soft has no
    bounds that are known ahead. The flag is that of parents and children which collide.
    """
    remembers = model.sensor_history.any() or model.sensor_interval.any()
    drags = model.geom_fluid[:, 0].any()
    wraps = (mujoco.mjtWrap.mjWRAP_SPHERE, mujoco.mjtWrap.mjWRAP_CYLINDER)
    wound = np.isin(model.wrap_type, [int(w) for w in wraps]).any()
    haste = not (remembers or drags or wound or model.nplugin or model.npair)
    return haste, haste and not model.nflex, model.opt.disableflags & _PARENTS


def _flags(option: Any) -> NDArray[np.int32]:
    """Return a view of the model's flags, off and on.

    They follow eight integers after the frictions, as mjmodel.h has it.
    """
    place = option.o_friction.ctypes.data + option.o_friction.nbytes + 8 * 4
    flags = np.ctypeslib.as_array((ctypes.c_int32 * 2).from_address(place))
    given = option.disableflags, option.enableflags
    option.disableflags, option.enableflags = given[0] ^ 1, given[1] ^ 2
    found = tuple(flags.tolist()) == (given[0] ^ 1, given[1] ^ 2)
    option.disableflags, option.enableflags = given
    assert found, "MuJoCo keeps its flags elsewhere"
    return flags


def _pairs(model: mujoco.MjModel) -> Indices:
    """Return the pairs of bodies that MuJoCo lets collide, one after the other.

    They are not welded together, not parent and child, and not excluded; bits of
    collision are looked at when they are needed.
    """
    weld = model.body_weldid
    above = weld[model.body_parentid[weld]]
    first, second = np.triu_indices(model.nbody, 1)
    own, other = weld[first], weld[second]
    good = own != other
    if not model.opt.disableflags & _PARENTS:
        child = (own == above[second]) | (other == above[first])
        good &= ~(child & (own != 0) & (other != 0))
    good &= ~np.isin((first << 16) + second, model.exclude_signature)
    return np.stack([first, second], axis=1)[good].ravel().astype(np.int64)


def _word_at(address: int) -> Indices:
    """Return a view of one integer, shape (1,)."""
    return np.ctypeslib.as_array((ctypes.c_int64 * 1).from_address(address))


@compiled
def may_haste(table: Indices) -> bool:
    """Tell whether steps may leave something out.

    Not where margins prevail over all others: MuJoCo bounds geoms without these.
    """
    flags = short_indices(table, Haste.FLAGS)
    return indices(table, Haste.MAY)[0] != 0 and flags[1] & _MARGINS == 0


@compiled
def begin_haste(table: Indices) -> None:
    """Let MuJoCo's next steps leave out what nobody sees of them, until `end_haste`.

    No sensor is read, and geoms that are only drawn are neither placed nor bounded.
    """
    pause = indices(table, Haste.PAUSE)
    pause[0] = max(pause[0] - 1, 0)
    for field in range(Haste.FLAGS, Haste.GIVEN_FLAGS):
        copy(table, field, field + _GIVEN)
    short_indices(table, Haste.FLAGS)[0] |= _NO_SENSORS
    show_bodies(table)


@compiled
def show_bodies(table: Indices) -> None:
    """Show the broadphase all bodies, with all their geoms that collide.

    Those are a span of a body's geoms, and all of these that MuJoCo knows of; between
    them may be others.
    """
    for field in range(Haste.BODY_GEOMADR, Haste.TREE_SLEEP_POLICY):
        copy(table, field + _GIVEN, field)
    kind = short_indices(table, Haste.GEOM_CONTYPE)
    affinity = short_indices(table, Haste.GEOM_CONAFFINITY)
    first = short_indices(table, Haste.BODY_GEOMADR)
    count = short_indices(table, Haste.BODY_GEOMNUM)
    for body in range(count.shape[0]):
        geom, end = first[body], first[body] + count[body]
        while geom < end and kind[geom] == 0 and affinity[geom] == 0:
            geom += 1
        if geom == end:
            continue  # it never collides
        while kind[end - 1] == 0 and affinity[end - 1] == 0:
            end -= 1
        first[body], count[body] = geom, end - geom


@compiled
def let_fixed_rest(table: Indices) -> None:
    """Leave what is fixed to the world where the last step has placed it.

    To MuJoCo it sleeps then; nothing else does.
    """
    flags = short_indices(table, Haste.FLAGS)
    if flags[1] & _SLEEP:
        return
    flags[1] |= _SLEEP
    policies = short_indices(table, Haste.TREE_SLEEP_POLICY)
    for tree in range(policies.shape[0]):
        policies[tree] = _NEVER


@compiled
def end_haste(table: Indices) -> None:
    """Let MuJoCo's steps be whole again."""
    for field in range(Haste.FLAGS, Haste.GIVEN_FLAGS):
        copy(table, field + _GIVEN, field)


@compiled
def may_hide(table: Indices) -> bool:
    """Tell whether far bodies may be hidden, and it is worth it."""
    may, flags = indices(table, Haste.MAY), short_indices(table, Haste.FLAGS)
    usual = may[1] != 0 and flags[0] & _PARENTS == may[2]
    return usual and indices(table, Haste.PAUSE)[0] == 0


@compiled
def copy(table: Indices, source: int, target: int) -> None:
    """Copy an array of short integers over another."""
    values, copies = short_indices(table, source), short_indices(table, target)
    for k in range(values.shape[0]):
        copies[k] = values[k]


@compiled
def stop_profiler(table: Indices) -> int:
    """Let MuJoCo not time what it does; return the function that it asks the time.

    Its Python package sets one, which is asked twenty times a step: a twentieth of all.
    """
    clock = indices(table, Haste.PROFILER)
    function = clock[0]
    clock[0] = 0
    return function


@compiled
def start_profiler(table: Indices, function: int) -> None:
    """Let MuJoCo time what it does again, if it did; another thread may have begun."""
    if function != 0:
        indices(table, Haste.PROFILER)[0] = function
