"""Check and compile MJCF files from untrusted sources.

A file of a hundred bytes can request 10^9 bodies or a height field of 10^10 points, so
the requested sizes are computed before compilation.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import mujoco

from wbc_suite.errors import ConfigError, DescriptionError
from wbc_suite.robot.mjcf_files import Model, ModelFiles
from wbc_suite.robot.xml_files import (
    MAX_DEPTH,
    Element,
    at_line,
    model_root,
    parse_xml,
    real_path,
)

MAX_ELEMENTS = 20_000
"""Largest number of elements, including generated ones; a kitchen has 5,000.
MuJoCo takes 3 s to compile 20,000, and over a minute for 120,000."""
MAX_COPIES = 10_000
"""Largest number of elements that one `replicate`, `composite` or `flexcomp` makes."""
MAX_POINTS = 20_000_000
"""Largest number of points of a height field, texture, camera or sensor: 160 MB."""
MAX_ROWS = 100_000  # largest number of keys or user numbers
MAX_MESH_PARAMETER = 500
"""Largest parameter of a builtin mesh: the number of faces grows with its square."""

_GENERATORS = ("replicate", "composite", "flexcomp")
_POINTS = (
    *("nrow", "ncol", "width", "height", "resolution"),
    *("dim", "num", "actdim", "nsample"),
)
_ROWS = ("nkey", "nuserdata")
_HINTS = ("memory", "njmax", "nconmax", "nstack")
"""Sizes that MuJoCo chooses itself; those of a file are ignored."""


def compile_mjcf(
    path: Path, *, root: Path | str | None = None
) -> tuple[mujoco.MjModel, mujoco.MjSpec]:
    """Compile an MJCF file and what it includes to a model and its specification.

    Args:
        path: The file.
        root: Folder that all files must lie in; by default the package or model folder
            that encloses the file.

    Raises:
        ConfigError: If it is not MJCF, or names a file outside the folder.
        DescriptionError: If it exceeds a limit, or MuJoCo refuses it.
    """
    files = ModelFiles(path, Path(root) if root else model_root(path, ()))
    _check_model(files.read(), path, files.where)
    try:
        spec = mujoco.MjSpec.from_file(str(real_path(path)))
        for hint in _HINTS:
            setattr(spec, hint, -1)
        return spec.compile(), spec
    except (ValueError, RuntimeError, MemoryError) as error:  # MuJoCo raises all three
        raise DescriptionError(f"{path}: MuJoCo refuses it: {error}") from error


def compile_text(text: str, *, source: str) -> mujoco.MjModel:
    """Compile MJCF text, which must name no files; errors as `compile_mjcf`."""
    root = parse_xml(text.encode(), source=source, only_utf8=True)

    def where(element: Element) -> str:
        return f"{source}: <{element.tag}>{at_line(element)}"

    for element in root.iter():
        if any(key.startswith("file") for key in element.attrib):
            raise ConfigError(f"{where(element)} names a file, which is not read.")
    _check_model(Model(root, {}, 0), Path(source), where)
    try:
        return mujoco.MjModel.from_xml_string(text)
    except (ValueError, RuntimeError, MemoryError) as error:
        raise DescriptionError(f"{source}: MuJoCo refuses it: {error}") from error


def _check_model(model: Model, path: Path, where: Callable[[Element], str]) -> None:
    """Refuse a model that asks for too much; `where` tells where an element is."""
    total = _Counter(model, where).size().elements
    if total > MAX_ELEMENTS:
        raise DescriptionError(
            f"{path}: {total:.6g} elements, including generated and attached ones; at "
            f"most {MAX_ELEMENTS} are allowed."
        )


class _Size(NamedTuple):
    """Elements that MuJoCo makes of an element with all below it, and their levels."""

    elements: float
    depth: int


class _Counter:
    """Checks the elements of a model, and counts what MuJoCo makes of them."""

    def __init__(self, model: Model, where: Callable[[Element], str]) -> None:
        self._root, self._where = model.root, where
        self._attached = {
            name: _Counter(own, where).size() for name, own in model.attached.items()
        }
        bodies = (e for e in model.root.iter() if e.tag in ("body", "frame"))
        self._named = {body.get("name"): body for body in bodies}
        self._sizes: dict[Element, _Size | None] = {}

    def size(self) -> _Size:
        """Return the size of the model, with that of the models that it reads.

        Raises:
            DescriptionError: If an element exceeds a limit.
        """
        own = self._size(self._root, 0)
        read = sum(size.elements for size in self._attached.values())
        return _Size(own.elements + read, own.depth)

    def _size(self, element: Element, level: int) -> _Size:
        size = self._sizes.get(element, _Size(0.0, 0))
        if size is None or level + size.depth > MAX_DEPTH:
            raise DescriptionError(
                f"{self._where(element)} holds itself, or is nested deeper than "
                f"{MAX_DEPTH} levels."
            )
        if element in self._sizes:
            return size
        where = self._where(element)
        _check_element(element, where)
        self._sizes[element] = None  # is being counted
        made, depth = 0.0, 0
        if element.tag == "attach":
            made, depth = self._copied(element, level + 1)
        for child in element:
            inner = self._size(child, level + 1)
            made, depth = made + inner.elements, max(depth, inner.depth)
        if element.tag in _GENERATORS:
            made = max(_copies(element, where), 1.0) * max(made, 1.0)
        self._sizes[element] = size = _Size(1.0 + made, 1 + depth)
        return size

    def _copied(self, element: Element, level: int) -> _Size:
        """Return the size of what an `<attach>` copies."""
        name = element.get("model")
        if name is not None:
            return self._attached.get(name, _Size(0.0, 0))  # MuJoCo reports it
        name = element.get("body") or element.get("frame")
        if name not in self._named:
            raise DescriptionError(
                f"{self._where(element)} copies '{name}', which is no body or frame "
                "that is written in this model."
            )
        return self._size(self._named[name], level)


def _copies(element: Element, where: str) -> float:
    made = _product(element.get("count", "1"))
    if not made <= MAX_COPIES:
        raise DescriptionError(
            f'{where} with count="{element.get("count")}" makes more than '
            f"{MAX_COPIES} elements."
        )
    return made


def _check_element(element: Element, where: str) -> None:
    """Refuse an element that requests more memory or time than any robot needs."""
    if element.tag in ("extension", "plugin"):
        raise DescriptionError(f"{where}: plugins run code and are not loaded.")
    _check_numbers(element, where)
    points = math.prod(_product(element.get(key, "1")) for key in _POINTS)
    sizes: list[tuple[str, float, float]] = [("points", points, MAX_POINTS)]
    sizes += [
        (key, _product(value), MAX_ROWS)
        for key, value in element.items()
        if key in _ROWS or key.startswith("nuser_")
    ]
    if element.tag == "numeric":
        sizes.append(("size", _product(element.get("size", "1")), MAX_ROWS))
    if element.get("builtin") and element.tag == "mesh":
        largest = max(map(_product, element.get("params", "0").split()), default=0.0)
        sizes.append(("params", largest, MAX_MESH_PARAMETER))
    for key, size, most in sizes:
        if not size <= most:
            raise DescriptionError(
                f"{where} asks for {key} of {size:.6g}; at most {most} are allowed."
            )


def _check_numbers(element: Element, where: str) -> None:
    """Refuse NaN, for which MuJoCo only prints a warning, and infinite numbers."""
    for key, value in element.items():
        words = () if key in ("name", "file") else value.split()
        if any(_is_wrong(word, key) for word in words):
            raise DescriptionError(
                f'{where}: {key}="{value:.80}" has a number that is not finite.'
            )


def _is_wrong(word: str, key: str) -> bool:
    """Whether a word is NaN or infinite; ranges may be infinite."""
    try:
        number = float(word)
    except ValueError:
        return False
    return math.isnan(number) or (math.isinf(number) and not key.endswith("range"))


def _product(text: str) -> float:
    """Return the product of the absolute numbers; 1 for text that MuJoCo refuses."""
    try:
        return math.prod(abs(float(word)) for word in text.split())
    except ValueError:
        return 1.0
