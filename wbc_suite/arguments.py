"""Check numbers and arrays at the public edge, so that nothing is checked further in.

What a caller passes may be anything. These functions return float64, or raise one
`ConfigError` that names the owner, the argument, the value and the rule; NumPy's and
Pinocchio's own messages would name none of them, and a C++ library may simply crash.
"""

import math

import numpy as np

from wbc_suite.errors import ConfigError
from wbc_suite.typing import Array

__all__ = ["check_array", "check_count", "check_number"]

_KINDS = "fiu"  # NumPy's letters for real numbers


def check_array(what: str, value: object, shape: tuple[int, ...] | None) -> Array:
    """Return real numbers as a float64 array, a copy only where one is needed.

    Args:
        what: Owner and argument, for the message: "Task 'hand': the target".
        value: Anything.
        shape: The shape it must have; None for any.

    Raises:
        ConfigError: If it holds anything but real numbers, or has another shape.
    """
    try:
        array = np.asarray(value)
    except ValueError as error:  # rows of different lengths
        raise ConfigError(f"{what} is no array: {_shorten(value)}.") from error
    if array.dtype.kind not in _KINDS and array.size:
        raise ConfigError(f"{what} must hold real numbers, not {_shorten(value)}.")
    if shape is not None and array.shape != shape:
        raise ConfigError(f"{what} has shape {array.shape}, and needs {shape}.")
    return array.astype(np.float64, copy=False)


def check_number(
    what: str,
    value: object,
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    most: float = math.inf,
    endless: bool = False,
) -> float:
    """Return a real number as a float.

    Args:
        what: Owner and argument, for the message.
        value: Anything.
        above: It must be greater than this.
        least: It must not be less than this.
        most: It must not be greater than this.
        endless: Whether infinity is allowed, as in "no limit".

    Raises:
        ConfigError: If it is no number, or breaks a rule.
    """
    number = float(check_array(what, value, ()))
    inside = above < number and least <= number <= most
    if endless:
        inside = inside or (number == math.inf == most)
    elif not math.isfinite(number):
        inside = False
    if not inside:
        rules = [
            *(() if endless else ("finite",)),
            *((f"greater than {above:g}",) if above > -math.inf else ()),
            *((f"at least {least:g}",) if least > -math.inf else ()),
            *((f"at most {most:g}",) if most < math.inf else ()),
        ]
        raise ConfigError(f"{what} is {value}, and must be {', '.join(rules)}.")
    return number


def check_count(what: str, value: object, *, least: int = 0) -> int:
    """Return a whole number.

    Raises:
        ConfigError: If it is no whole number, or is less than `least`.
    """
    number = check_number(what, value, least=least)
    if number != int(number):
        raise ConfigError(f"{what} is {value}, and must be a whole number.")
    return int(number)


def _shorten(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
