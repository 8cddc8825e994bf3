"""Memory: arrays as one vector."""

import numpy as np

from wbc_suite.control.memory import LARGEST, Memory

RECORD = np.dtype([("count", "i8"), ("goal", "f8", (3,))])


def test_arrays_are_read_and_written_as_one_vector():
    records, matrix = np.zeros(2, RECORD), np.arange(6.0).reshape(2, 3)
    memory = Memory([records["count"], records["goal"], matrix[:, 1]])
    records["count"], records["goal"] = (7, 8), [[1.0, 2.0, np.inf], [3.0, 4.0, 5.0]]
    values = memory.read()
    assert memory.size == 10
    np.testing.assert_array_equal(values[:5], [7, 8, 1, 2, LARGEST])
    kept = records.copy()
    records["count"], records["goal"], matrix[:] = 0, 0.0, 0.0
    memory.write(values)
    np.testing.assert_array_equal(records["count"], kept["count"])
    assert records["goal"][0, 2] == LARGEST
    np.testing.assert_array_equal(matrix, [[0.0, 1.0, 0.0], [0.0, 4.0, 0.0]])


def test_without_arrays_there_are_no_values():
    assert Memory([]).read().size == 0
