"""Check and compile MJCF files from untrusted sources.

A file of a hundred bytes can request 10^9 bodies or a height field of 10^10 points, so
the requested sizes are computed before compilation.
"""

import math
import struct
from pathlib import Path

import mujoco

from wbc_suite.errors import ConfigError, DescriptionError
from wbc_suite.robot.xml_files import Element, inside, model_root, read_xml

MAX_FILES = 50  # largest number of XML files that include one another
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
MAX_FILE = 200_000_000  # largest mesh or picture file, bytes

_GENERATORS = ("replicate", "composite", "flexcomp")
_POINTS = (
    *("nrow", "ncol", "width", "height", "resolution"),
    *("dim", "num", "actdim", "nsample"),
)
_ROWS = ("nkey", "nuserdata")
_HINTS = ("memory", "njmax", "nconmax", "nstack")
"""Sizes that MuJoCo chooses itself; those of a file are ignored."""
_PNG = b"\x89PNG\r\n\x1a\n"


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
    folder = Path(root) if root else model_root(path, ())
    roots = _included(path, folder)
    total = sum(_element_count(root, path) for root in roots)
    if total > MAX_ELEMENTS:
        raise DescriptionError(
            f"{path}: {total:.6g} elements, including generated ones; at most "
            f"{MAX_ELEMENTS} are allowed."
        )
    for top in roots:
        if top.find("extension") is not None or top.find(".//plugin") is not None:
            raise DescriptionError(f"{path}: plugins run code and are not loaded.")
        _check_referenced_files(top, path, folder)
        for element in top.iter():
            _check_size(element, path)
            _check_numbers(element, path)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        for hint in _HINTS:
            setattr(spec, hint, -1)
        return spec.compile(), spec
    except (ValueError, RuntimeError, MemoryError) as error:  # MuJoCo raises all three
        raise DescriptionError(f"{path}: MuJoCo refuses it: {error}") from error


def _included(path: Path, folder: Path) -> list[Element]:
    """Return the root elements of a file and of the files that it includes."""
    roots: dict[Path, Element] = {}
    waiting = [path]
    while waiting:
        file = waiting.pop()
        resolved = inside(folder, file, source=path)
        if resolved in roots:
            continue
        root = read_xml(resolved)
        if not roots and root.tag != "mujoco":
            hint = " It looks like URDF: name it .urdf." if root.tag == "robot" else ""
            raise ConfigError(
                f"{path}: an MJCF file begins with <mujoco>, not <{root.tag}>.{hint}"
            )
        roots[resolved] = root
        if len(roots) > MAX_FILES:
            raise ConfigError(f"{path}: it includes more than {MAX_FILES} files.")
        for element in (*root.iter("include"), *root.iter("model")):
            waiting.append(path.parent / element.get("file", ""))
    return list(roots.values())


def _check_referenced_files(root: Element, path: Path, outer: Path) -> None:
    """Refuse meshes, textures and the like from outside the outer folder."""
    keys = ("meshdir", "texturedir", "assetdir")
    folders = [e.get(key, "") for e in root.iter("compiler") for key in keys]
    for element in root.iter():
        for key, name in element.items():
            if key.startswith("file") and name:
                for folder in ("", *filter(None, folders)):
                    file = path.parent / folder / name
                    if file.exists():  # MuJoCo reports a missing file
                        _check_file(inside(outer, file, source=path), source=path)


def _check_file(file: Path, *, source: Path) -> None:
    """Refuse a mesh or picture with too many bytes or pixels."""
    try:
        if not file.is_file():
            return  # MuJoCo reports a missing file
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
            + (f" and {pixels} pixels" if pixels else "")
            + f"; at most {MAX_FILE} bytes and {MAX_POINTS} pixels are allowed."
        )


def _element_count(element: Element, path: Path) -> float:
    """Return the number of elements that an element and its children generate."""
    inner = sum(_element_count(child, path) for child in element)
    if element.tag not in _GENERATORS:
        return 1 + inner
    made = _product(element.get("count", "1"))
    if not made <= MAX_COPIES:
        raise DescriptionError(
            f'{path}: <{element.tag} count="{element.get("count")}"> makes more than '
            f"{MAX_COPIES} elements."
        )
    return 1 + max(made, 1.0) * max(inner, 1.0)


def _check_size(element: Element, path: Path) -> None:
    """Refuse an element that requests more memory or time than any robot needs."""
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
                f"{path}: <{element.tag}> asks for {key} of {size:.6g}; at most {most} "
                "are allowed."
            )


def _check_numbers(element: Element, path: Path) -> None:
    """Refuse NaN, for which MuJoCo only prints a warning."""
    for key, value in element.items():
        if key not in ("name", "file") and "nan" in value.lower().split():
            raise DescriptionError(
                f'{path}: <{element.tag} {key}="{value:.80}"> contains NaN; give '
                "numbers."
            )


def _product(text: str) -> float:
    """Return the product of the absolute numbers; 1 for text that MuJoCo refuses."""
    try:
        return math.prod(abs(float(word)) for word in text.split())
    except ValueError:
        return 1.0
