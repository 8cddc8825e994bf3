"""MuJoCo as compiled code sees it: its step functions, and views of its arrays."""

from collections.abc import Callable
from enum import IntEnum
from typing import Any, NamedTuple, cast

import mujoco
import numpy as np
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, models, register_model
from numba.np.arrayobj import make_array

from wbc_suite.control.loop.haste import load_mujoco
from wbc_suite.kinematics.array_table import (
    INDICES,
    MATRIX,
    VECTOR,
    ArrayTable,
    array_at,
)
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["Physics", "bind_physics", "physics_of", "physics_table"]
__all__ += ["mj_comPos", "mj_kinematics", "mj_step1", "mj_step2"]

WANTED, PULL, PLACE, REST, CHANGE, COLUMN = 18, 19, 20, 21, 22, 23
VECTORS, LIMITS, ROTATIONS, INERTIA = 24, 33, 35, 56
"""Rows of a law's scratch after three matrices of six rows: vectors, rotations of three
rows each, the inertia, then what `straight` needs."""

load_mujoco()
_OF_MODEL_AND_DATA = types.void(types.intp, types.intp)

mj_step1 = types.ExternalFunction("mj_step1", _OF_MODEL_AND_DATA)
mj_step2 = types.ExternalFunction("mj_step2", _OF_MODEL_AND_DATA)
mj_kinematics = types.ExternalFunction("mj_kinematics", _OF_MODEL_AND_DATA)
mj_comPos = types.ExternalFunction("mj_comPos", _OF_MODEL_AND_DATA)


class Physics(NamedTuple):
    """Addresses of a model and its data, and views of their arrays.

    Valid as long as model and data live; names are MuJoCo's.
    """

    model: int
    data: int
    timestep: float
    qpos: Vector
    qvel: Vector
    ctrl: Vector
    qfrc_bias: Vector
    qfrc_passive: Vector
    M: Vector
    M_rownnz: Indices
    M_rowadr: Indices
    M_colind: Indices
    site_xpos: Matrix
    site_xmat: Matrix
    xpos: Matrix
    xmat: Matrix
    cdof: Matrix
    cdof_dot: Matrix
    cvel: Matrix
    subtree_com: Matrix
    site_bodyid: Indices
    body_rootid: Indices
    body_last_dof: Indices
    dof_parentid: Indices
    acceleration: Vector
    """What laws ask of each degree of freedom, shape (nv,): scratch of the loop."""
    force: Vector
    """M times that, shape (nv,): scratch of the loop."""
    slots: Indices
    """Place of each degree of freedom in one law, -1 of those it does not drive, shape
    (nv,): scratch of that law."""
    work: Matrix
    """Scratch of one law, shape (70 + 6 nv, 2 nv + 8); see its rows above."""


_NUMBERS = ("model", "data", "timestep")
_ARRAYS = tuple(name for name in Physics._fields if name not in _NUMBERS)
_INDICES = ("M_rownnz", "M_rowadr", "M_colind", "site_bodyid", "body_rootid")
_INDICES += ("body_last_dof", "dof_parentid", "slots")
_MATRICES = ("site_xpos", "site_xmat", "xpos", "xmat", "cdof", "cdof_dot", "cvel")
_MATRICES += ("subtree_com", "work")
_KINDS: dict[str, Any] = (
    dict.fromkeys(_ARRAYS, VECTOR)
    | dict.fromkeys(_INDICES, INDICES)
    | dict.fromkeys(_MATRICES, MATRIX)
)

PhysicsField = cast(
    "type[IntEnum]",
    IntEnum("PhysicsField", [name.upper() for name in _ARRAYS], start=0),
)
"""Places of the arrays of `Physics` in a `physics_table`."""


def bind_physics(model: mujoco.MjModel, data: mujoco.MjData) -> Physics:
    """Return the view of a simulation for compiled code."""
    own = {
        "body_last_dof": _last_dofs(model),
        "acceleration": np.zeros(model.nv),
        "force": np.zeros(model.nv),
        "slots": np.full(model.nv, -1, dtype=np.int64),
        "work": np.zeros((70 + 6 * model.nv, 2 * model.nv + 8)),
    }
    views = {
        name: getattr(data if hasattr(data, name) else model, name)
        for name in _ARRAYS
        if name not in own
    }
    constant = {
        name: array.astype(np.int64)
        for name, array in views.items()
        if array.dtype == np.int32
    }
    return Physics(
        model=model._address,
        data=data._address,
        timestep=float(model.opt.timestep),
        **{**views, **constant, **own},
    )


def physics_table(physics: Physics) -> ArrayTable:
    """Return where the arrays are: one argument of compiled calls in place of all."""
    arrays = physics._asdict()
    return ArrayTable(
        PhysicsField, {field: arrays[_ARRAYS[field]] for field in PhysicsField}
    )


class _PhysicsType(types.Type):
    """A `Physics` in compiled code: where its table is, and the timestep.

    Attributes are read where they are asked for. A call hands over two numbers, not
    the seven of each array; those take most of the time to compile.
    """

    def __init__(self) -> None:
        super().__init__(name="Physics")


@register_model(_PhysicsType)
class _PhysicsModel(models.StructModel):
    def __init__(self, manager: Any, kind: _PhysicsType) -> None:
        members = [("table", types.CPointer(types.int64)), ("timestep", types.float64)]
        super().__init__(manager, kind, members)


@infer_getattr
class _PhysicsAttributes(AttributeTemplate):
    key = _PhysicsType

    def generic_resolve(self, value: _PhysicsType, attr: str) -> types.Type | None:
        return types.float64 if attr == "timestep" else _KINDS.get(attr)


@lower_getattr_generic(_PhysicsType)
def _read(context: Any, builder: Any, kind: Any, value: Any, attr: str) -> Any:
    physics = cgutils.create_struct_proxy(kind)(context, builder, value=value)
    if attr == "timestep":
        return physics.timestep
    place = context.get_constant(types.intp, 3 * _ARRAYS.index(attr))
    words = builder.gep(physics.table, [place])
    return array_at(context, builder, _KINDS[attr], words)


def _physics_of(typingctx: Any, table: Any, timestep: Any) -> Any:
    def write(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        physics = cgutils.create_struct_proxy(signature.return_type)(context, builder)
        physics.table = make_array(table)(context, builder, args[0]).data
        physics.timestep = args[1]
        return physics._getvalue()

    return _PhysicsType()(table, types.float64), write


physics_of = cast("Callable[[Indices, float], Physics]", intrinsic(_physics_of))
"""Compiled code's view of the arrays that a `physics_table` tells."""


def _last_dofs(model: mujoco.MjModel) -> Indices:
    """Return the last degree of freedom that moves each body, -1 without any."""
    last = np.full(model.nbody, -1, dtype=np.int64)
    for body in range(1, model.nbody):
        count = int(model.body_dofnum[body])
        own = int(model.body_dofadr[body]) + count - 1
        last[body] = own if count else last[model.body_parentid[body]]
    return last
