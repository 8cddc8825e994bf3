"""Checks of numbers and arrays: what passes, and the message of what does not."""

import math

import numpy as np
import pytest

from wbc_suite.arguments import check_array, check_count, check_number
from wbc_suite.errors import ConfigError


@pytest.mark.parametrize("value", [[1, 2], (1.0, 2.0), np.array([1, 2], np.uint8)])
def test_arrays_become_float64(value):
    array = check_array("x", value, (2,))
    assert array.dtype == np.float64
    np.testing.assert_array_equal(array, [1.0, 2.0])


def test_a_float64_array_is_not_copied():
    array = np.zeros(3)
    assert check_array("x", array, (3,)) is array


def test_an_empty_list_is_an_empty_array():
    assert check_array("x", [], None).shape == (0,)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ([1, 2], r"Owner: x has shape \(2,\), but must have \(3,\)\."),
        ([[1], [2, 3]], r"Owner: x is not an array: \[\[1\], \[2, 3\]\]\."),
        (["a"], r"Owner: x must hold real numbers, not \['a'\]\."),
        ([True], r"must hold real numbers, not \[True\]"),
        ([1j], "must hold real numbers"),
        (None, "must hold real numbers, not None"),
    ],
)
def test_other_arrays_are_refused(value, message):
    with pytest.raises(ConfigError, match=message):
        check_array("Owner: x", value, (3,))


def test_a_long_value_is_cut_in_the_message():
    with pytest.raises(ConfigError) as caught:
        check_array("x", ["a" * 500], None)
    assert len(str(caught.value)) < 120


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.array(2)])
def test_numbers_become_floats(value):
    number = check_number("x", value)
    assert type(number) is float
    assert number == 2.0


@pytest.mark.parametrize(
    ("bounds", "inside", "outside"),
    [
        ({"above": 0.0}, (1e-9, 1e9), (0.0, -1.0, math.inf, math.nan)),
        ({"least": 0.0}, (0.0, 1.0), (-1e-9, -math.inf)),
        ({"most": 1.0}, (1.0, -5.0), (1.0 + 1e-9, math.inf, -math.inf)),
        ({"above": 0.0, "allow_inf": True}, (1.0, math.inf), (0.0, math.nan)),
        ({"most": 1.0, "allow_inf": True}, (1.0,), (math.inf,)),
    ],
)
def test_bounds_are_kept(bounds, inside, outside):
    for value in inside:
        assert check_number("x", value, **bounds) == value
    for value in outside:
        with pytest.raises(ConfigError):
            check_number("x", value, **bounds)


def test_the_message_lists_every_rule():
    with pytest.raises(ConfigError) as caught:
        check_number("Task 'hand': gain", 3, above=0.0, most=1.0)
    assert str(caught.value) == (
        "Task 'hand': gain is 3, but must be finite, greater than 0, at most 1."
    )


def test_counts_are_integers():
    assert check_count("n", 3.0, least=1) == 3
    with pytest.raises(ConfigError, match=r"n is 2\.5, but must be an integer"):
        check_count("n", 2.5)
    with pytest.raises(ConfigError, match="n is 0, but must be finite, at least 1"):
        check_count("n", 0, least=1)
