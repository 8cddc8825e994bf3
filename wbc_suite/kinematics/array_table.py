"""Arrays that kernels find by their addresses: one argument in place of forty.

Numba takes 0.1 us to unpack each array argument of a call, more when caches are cold,
and the arrays of a tick never move. So they are bound once: a table holds address and
shape of each, in the order of an enumeration, and a kernel reads them back by name,

    W = matrix(table, Row.W)

The table says nothing about lifetimes: whoever makes it keeps its arrays, see
`ArrayTable`.
"""

from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Any, cast

import numpy as np
from numba import types
from numba.extending import intrinsic
from numba.np import arrayobj
from numba.np.numpy_support import carray
from numpy.typing import NDArray

from wbc_suite.compiling import compiled
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["INDICES", "MATRIX", "VECTOR", "ArrayTable"]
__all__ += ["array_at", "indices", "matrix", "short_indices", "vector", "vector_at"]


_numba: Any = arrayobj  # it has no types


class ArrayTable:
    """Addresses and shapes of arrays, which live as long as the table.

    Args:
        fields: Names the arrays; its values count from 0.
        arrays: One for each field: float64, int64 or int32, C-contiguous.

    Attributes:
        table: Address, rows and columns by field, shape (n, 3); vectors are one row.
    """

    def __init__(
        self, fields: type[IntEnum], arrays: Mapping[IntEnum, NDArray[Any]]
    ) -> None:
        assert set(arrays) == set(fields), "an array for each field"
        self.table: Indices = np.zeros((len(fields), 3), dtype=np.int64)
        self._arrays = dict(arrays)
        for field, array in self._arrays.items():
            assert array.flags.c_contiguous, field
            assert array.dtype in (np.float64, np.int64, np.int32), field
            rows = array.shape if array.ndim == 2 else (1, array.size)
            self.table[field] = array.ctypes.data, *rows

    def __getitem__(self, field: IntEnum) -> NDArray[Any]:
        """Return an array. A buffer."""
        return self._arrays[field]


def array_at(context: Any, builder: Any, kind: Any, words: Any) -> Any:
    """Write code that makes a view of an array from its row of a table.

    Loads are marked as invariant: a table is complete before kernels read it, so one
    load in a kernel serves all its loops.

    Args:
        context: Numba's target.
        builder: Of the function that code is added to.
        kind: Type of the view: C-contiguous, one or two dimensions.
        words: Pointer to the array's row, int64.

    Returns:
        The view, which owns nothing.
    """
    address, rows, columns = (
        builder.load(builder.gep(words, [context.get_constant(types.intp, k)]))
        for k in range(3)
    )
    for word in (address, rows, columns):
        word.set_metadata("invariant.load", builder.module.add_metadata([]))
    view = _numba.make_array(kind)(context, builder)
    itemsize = context.get_constant(types.intp, kind.dtype.bitwidth // 8)
    shape = (rows, columns) if kind.ndim == 2 else (builder.mul(rows, columns),)
    strides = (itemsize,)
    if kind.ndim == 2:
        strides = (builder.mul(columns, itemsize), itemsize)
    _numba.populate_array(
        view,
        data=builder.inttoptr(address, view.data.type),
        shape=shape,
        strides=strides,
        itemsize=itemsize,
        meminfo=None,
    )
    return view._getvalue()


def _view(kind: Any) -> Callable[..., Any]:
    """Return what numba asks for a function (table, field) -> view."""

    def write(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        table = _numba.make_array(signature.args[0])(context, builder, args[0])
        place = builder.mul(args[1], context.get_constant(types.intp, 3))
        return array_at(context, builder, kind, builder.gep(table.data, [place]))

    def typed(typingctx: Any, table: Any, field: Any) -> Any:
        return kind(table, types.intp), write

    return typed


VECTOR: Any = types.Array(types.float64, 1, "C")
MATRIX: Any = types.Array(types.float64, 2, "C")
INDICES: Any = types.Array(types.int64, 1, "C")
_SHORT: Any = types.Array(types.int32, 1, "C")

# Written where they are called: each function would be compiled for each field.
matrix = cast("Callable[[Indices, int], Matrix]", intrinsic(_view(MATRIX)))
vector = cast("Callable[[Indices, int], Vector]", intrinsic(_view(VECTOR)))
indices = cast("Callable[[Indices, int], Indices]", intrinsic(_view(INDICES)))
short_indices = cast("Callable[[Indices, int], Indices]", intrinsic(_view(_SHORT)))
"""Of int32, as MuJoCo has them."""


def _float_pointer(typingctx: Any, address: Any) -> Any:
    def write(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], context.get_value_type(signature.return_type))

    return types.CPointer(types.float64)(types.intp), write


_floats = cast("Callable[[int], Any]", intrinsic(_float_pointer))


@compiled
def vector_at(address: int, size: int) -> Vector:
    """Return a view of float64 values at an address."""
    return carray(_floats(address), size)
