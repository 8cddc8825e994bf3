from enum import IntEnum

import numba
import numpy as np
import pytest

from wbc_suite.kinematics.array_table import (
    ArrayTable,
    indices,
    matrix,
    vector,
    vector_at,
)


class Field(IntEnum):
    M = 0
    V = 1
    K = 2


@numba.njit
def read_and_write(table):
    M, v, k = matrix(table, Field.M), vector(table, Field.V), indices(table, Field.K)
    v[0] = M[1, 2]
    return M.shape, k[1], vector_at(table[Field.M, 0], 2)[1]


def test_kernels_read_and_write_arrays_by_name():
    M, v, k = np.arange(6.0).reshape(2, 3), np.zeros(4), np.array([7, 8])
    arrays = ArrayTable(Field, {Field.V: v, Field.M: M, Field.K: k})
    assert read_and_write(arrays.table) == ((2, 3), 8, 1.0)
    assert v[0] == M[1, 2]


@pytest.mark.parametrize(
    "wrong",
    [np.zeros((3, 2)).T, np.zeros(3, dtype=np.float32), np.zeros(6)[::2]],
    ids=["by columns", "single precision", "with gaps"],
)
def test_arrays_that_kernels_would_misread_are_refused(wrong):
    arrays = {Field.M: wrong, Field.V: np.zeros(1), Field.K: np.zeros(1)}
    with pytest.raises(AssertionError):
        ArrayTable(Field, arrays)
    with pytest.raises(AssertionError, match="each field"):
        ArrayTable(Field, {Field.V: np.zeros(1)})
