"""Rows that grow on disk."""

import numpy as np
import pytest

from wbc_suite.recording.step_buffer import BLOCK_BYTES, RowBuffer

KIND = np.dtype([("picture", "u1", (2, 3)), ("number", "f8")], align=True)
BLOCK = BLOCK_BYTES // KIND.itemsize  # rows


def fill(log, rows):
    """Begin each row while the one before it is in progress."""
    for row in rows[1:]:
        log.pair[1 - log.at] = row
        log.advance()


@pytest.fixture
def log(tmp_path):
    made = RowBuffer(tmp_path)
    made.begin(KIND)
    yield made
    made.close()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("count", [1, 2, BLOCK, BLOCK + 1, 3 * BLOCK + 7])
def test_rows_come_back_as_they_were_added(log, count):
    rng = np.random.default_rng(count)
    rows = np.zeros(count, dtype=KIND)
    rows["picture"] = rng.integers(0, 255, size=(count, 2, 3))
    rows["number"] = rng.normal(size=count)
    log.pair[0] = rows[0]
    fill(log, rows)
    assert len(log) == count - 1
    np.testing.assert_array_equal(log.rows(), rows)


def test_rows_go_on_after_they_were_read(log):
    rows = np.zeros(3 * BLOCK, dtype=KIND)
    rows["number"] = np.arange(len(rows))
    log.pair[0] = rows[0]
    for count in (7, BLOCK + 3, BLOCK + 4, len(rows)):
        fill(log, rows[len(log) : count])
        np.testing.assert_array_equal(log.rows(), rows[:count])
