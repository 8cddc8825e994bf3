import numpy as np

from wbc_suite.viewers.history import History


def test_rows_come_oldest_first_and_only_the_last_ones_stay():
    history = History(2, 3)
    for k in range(5):
        history.append(np.array([k, 10 * k]))
    np.testing.assert_array_equal(history.rows(), [[2, 20], [3, 30], [4, 40]])
    assert len(history) == 3


def test_cleared_history_is_empty():
    history = History(1, 4)
    history.append(np.array([1.0]))
    history.clear()
    assert history.rows().shape == (0, 1)
