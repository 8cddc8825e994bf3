"""Read numbers and poses from the attributes of URDF elements."""

from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from wbc_suite.errors import DescriptionError
from wbc_suite.typing import Vector

__all__ = ["number", "numbers", "pose_of"]

Element = ElementTree.Element


def numbers(
    element: Element,
    key: str,
    count: int,
    *,
    where: str,
    default: Sequence[float] | None = None,
) -> Vector:
    """Read an attribute of several finite numbers.

    Raises:
        DescriptionError: If it is missing without a default, or no such numbers.
    """
    text = element.get(key)
    if text is None:
        if default is None:
            raise DescriptionError(f"{where}: <{element.tag}> needs '{key}'.")
        return np.asarray(default, dtype=np.float64)
    try:
        values = np.array([float(word) for word in text.split()], dtype=np.float64)
    except ValueError:
        values = np.array([np.nan])
    if values.shape != (count,) or not np.isfinite(values).all():
        wanted = "a finite number" if count == 1 else f"{count} finite numbers"
        raise DescriptionError(
            f'{where}: <{element.tag} {key}="{text}"> must be {wanted}.'
        )
    return values


def number(
    element: Element, key: str, *, where: str, default: float | None = None
) -> float:
    """Read an attribute of one finite number."""
    fallback = None if default is None else (default,)
    return float(numbers(element, key, 1, where=where, default=fallback)[0])


def pose_of(element: Element, *, where: str) -> pin.SE3:
    """Read the `<origin>` of an element; the identity when it has none."""
    origin = element.find("origin")
    if origin is None:
        return pin.SE3.Identity()
    zero = (0.0, 0.0, 0.0)
    xyz = numbers(origin, "xyz", 3, where=where, default=zero)
    rpy = numbers(origin, "rpy", 3, where=where, default=zero)
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz)
