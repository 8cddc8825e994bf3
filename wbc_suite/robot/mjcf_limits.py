"""What an MJCF file from outside may ask for, before MuJoCo makes it.

A hundred bytes can name 10^9 bodies, a height field of 10^10 points, or room for as
many contacts. Nothing of it is in the file, so its size says nothing: it is counted.
"""

import math
import struct
from pathlib import Path
from xml.etree import ElementTree

from wbc_suite.errors import DescriptionError

__all__ = ["check_file", "check_size"]

Element = ElementTree.Element

MAX_ELEMENTS = 20_000
"""Most elements of a model, those included that others make; a kitchen has 5,000.
MuJoCo takes 3 s to compile 20,000, and over a minute for 120,000."""
MAX_COPIES = 10_000
"""Most elements that one `replicate`, `composite` or `flexcomp` may make."""
MAX_POINTS = 20_000_000
"""Most points of one height field, texture, camera or sensor: 160 MB."""
MAX_ROWS = 100_000
"""Most contacts, constraints, keys, or numbers of a user's."""
MAX_MEMORY = 1 << 32
"""Bytes that a model may ask for by `memory`."""
MAX_FINENESS = 500
"""Largest parameter of a mesh that is computed: its faces grow by the square."""
MAX_FILE = 200_000_000
"""Bytes of one mesh or picture."""

_MAKERS = ("replicate", "composite", "flexcomp")
_POINTS = (
    *("nrow", "ncol", "width", "height", "resolution"),
    *("dim", "num", "actdim", "nsample"),
)
_ROWS = ("nkey", "njmax", "nconmax", "nstack", "nuserdata")
_UNITS = {"K": 10, "M": 20, "G": 30, "T": 40, "P": 50, "E": 60}
_PNG = b"\x89PNG\r\n\x1a\n"


def check_size(roots: list[Element], path: Path) -> None:
    """Refuse what would take more memory or time than any robot needs.

    Args:
        roots: Roots of a file and of those that it includes.
        path: The file, for errors.

    Raises:
        DescriptionError: Names the element and the limit.
    """
    total = sum(_made_by(root, path) for root in roots)
    if total > MAX_ELEMENTS:
        raise DescriptionError(
            f"{path}: {total:.6g} elements, copies included; at most {MAX_ELEMENTS} "
            "are read."
        )
    for root in roots:
        for element in root.iter():
            _check_element(element, path)


def check_file(file: Path, *, source: Path) -> None:
    """Refuse a mesh or picture that is too large, or that claims to be.

    Raises:
        DescriptionError: Names the file and the limit.
    """
    try:
        if not file.is_file():
            return  # MuJoCo says so, if it is there that it looks
        size = file.stat().st_size
        with file.open("rb") as stream:
            head = stream.read(24)
    except OSError as error:
        raise DescriptionError(f"{source}: '{file}': {error.strerror}.") from error
    pixels = 0
    if head.startswith(_PNG) and len(head) == 24:
        pixels = math.prod(struct.unpack(">II", head[16:]))
    if size > MAX_FILE or pixels > MAX_POINTS:
        raise DescriptionError(
            f"{source}: '{file.name}' has {size} bytes"
            + (f" and claims {pixels} pixels" if pixels else "")
            + f"; at most {MAX_FILE} bytes and {MAX_POINTS} pixels are read."
        )


def _made_by(element: Element, path: Path) -> float:
    """Return how many elements one becomes, with what is in it."""
    inner = sum(_made_by(child, path) for child in element)
    if element.tag not in _MAKERS:
        return 1 + inner
    made = _product(element.get("count", "1"))
    if not made <= MAX_COPIES:
        raise DescriptionError(
            f'{path}: <{element.tag} count="{element.get("count")}"> makes more than '
            f"{MAX_COPIES} elements."
        )
    return 1 + max(made, 1.0) * max(inner, 1.0)


def _check_element(element: Element, path: Path) -> None:
    points = math.prod(_product(element.get(key, "1")) for key in _POINTS)
    sizes: list[tuple[str, float, float]] = [("points", points, MAX_POINTS)]
    sizes += [
        (key, _product(value), MAX_ROWS)
        for key, value in element.items()
        if key in _ROWS or key.startswith("nuser_")
    ]
    if element.tag == "numeric":
        sizes.append(("size", _product(element.get("size", "1")), MAX_ROWS))
    if element.tag == "size":
        sizes.append(("memory", _memory(element.get("memory", "0")), MAX_MEMORY))
    if element.get("builtin") and element.tag == "mesh":
        words = element.get("params", "0").split()
        sizes.append(("params", max(map(_product, words), default=0.0), MAX_FINENESS))
    for key, size, most in sizes:
        if not size <= most:
            raise DescriptionError(
                f"{path}: <{element.tag}> asks for {key} of {size:.6g}; at most {most} "
                "are allowed."
            )


def _product(text: str) -> float:
    """Return the product of the sizes of numbers; 1 for what MuJoCo will refuse."""
    try:
        return math.prod(abs(float(word)) for word in text.split())
    except ValueError:
        return 1.0


def _memory(text: str) -> float:
    word = text.strip()
    unit = _UNITS.get(word[-1:].upper(), 0)
    return _product(word[:-1] if unit else word) * 2.0**unit
