"""Checks of numbers and arrays that callers pass in.

Public functions check their arguments here, so that no inner code has to. A check
returns float64, or raises a `ConfigError` that names owner, argument, value and rule.
"""

import math

import numpy as np

from wbc_suite.errors import ConfigError, shortened
from wbc_suite.typing import Array


def check_array(what: str, value: object, shape: tuple[int, ...] | None) -> Array:
    """Return real numbers as a float64 array, copied only if needed.

    `what` names owner and argument for the message: "Task 'hand': the target".

    Raises:
        ConfigError: If the value is not an array of real numbers of that shape; any
            shape is allowed if it is None.
    """
    try:
        array = np.asarray(value)
    except ValueError as error:  # rows of different lengths
        raise ConfigError(f"{what} is not an array: {_shown(value)}.") from error
    if array.dtype.kind not in "fiu" and array.size:  # float, int, unsigned
        raise ConfigError(f"{what} must hold real numbers, not {_shown(value)}.")
    if shape is not None and array.shape != shape:
        raise ConfigError(f"{what} has shape {array.shape}, but must have {shape}.")
    return array.astype(np.float64, copy=False)


def check_number(
    what: str,
    value: object,
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    most: float = math.inf,
    allow_inf: bool = False,
) -> float:
    """Return a real number as a float.

    Raises:
        ConfigError: If it is not a number, not greater than `above`, not from `least`
            to `most`, or infinite; `allow_inf` permits +inf, as in "no limit".
    """
    number = float(check_array(what, value, ()))
    valid = above < number and least <= number <= most
    if not (valid and (math.isfinite(number) or allow_inf)):
        rules = {
            "finite": not allow_inf,
            f"greater than {above:g}": above > -math.inf,
            f"at least {least:g}": least > -math.inf,
            f"at most {most:g}": most < math.inf,
        }
        shown = ", ".join(rule for rule, applies in rules.items() if applies)
        raise ConfigError(f"{what} is {value}, but must be {shown}.")
    return number


def check_count(what: str, value: object, *, least: int = 0) -> int:
    """Return an integer.

    Raises:
        ConfigError: If it is not an integer, or is less than `least`.
    """
    number = check_number(what, value, least=least)
    if number != int(number):
        raise ConfigError(f"{what} is {value}, but must be an integer.")
    return int(number)


def _shown(value: object) -> str:
    return shortened(repr(value), 60)
