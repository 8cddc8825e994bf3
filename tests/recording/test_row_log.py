"""Rows that grow on disk."""

import numpy as np
import pytest

from wbc_suite.errors import DatasetError
from wbc_suite.recording.row_log import MAX_ROWS, RowLog


@pytest.mark.parametrize("rows", [1, MAX_ROWS, 3 * MAX_ROWS + 7])
def test_rows_come_back_as_they_were_added(tmp_path, rows):
    rng = np.random.default_rng(rows)
    pictures = rng.integers(0, 255, size=(rows, 2, 3), dtype=np.uint8)
    numbers = rng.normal(size=rows)
    log = RowLog(tmp_path)
    for picture, number in zip(pictures, numbers, strict=True):
        log.append({"picture": picture, "number": number})
    assert len(log) == rows
    columns = log.columns()
    np.testing.assert_array_equal(columns["picture"], pictures)
    np.testing.assert_array_equal(columns["number"], numbers)
    assert columns["picture"].dtype == np.uint8
    log.close()
    assert not list(tmp_path.iterdir())


def test_a_row_of_another_shape_is_told(tmp_path):
    log = RowLog(tmp_path)
    log.append({"a": np.zeros(3)})
    with pytest.raises(DatasetError, match="'a' differs"):
        log.append({"a": np.zeros(4)})
    with pytest.raises(DatasetError, match="'a' differs"):
        log.append({"b": np.zeros(3)})
