"""Read XML files from untrusted sources: no entities, limited size and depth."""

import codecs
import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import TypeAlias, cast
from xml.etree import ElementTree
from xml.parsers import expat

from wbc_suite.errors import ConfigError
from wbc_suite.files import read_bytes

MAX_BYTES = 8_000_000
"""Largest XML file that is read; large humanoids have about 200 kB."""
MAX_ELEMENTS = 100_000  # largest number of elements of a file
MAX_DEPTH = 400  # largest nesting depth; MJCF nests one body per link of a chain

ROBOT_FOLDERS = ("urdf", "urdfs", "robots", "mjcf", "xml")
COLLECTIONS = (*ROBOT_FOLDERS, "descriptions", "models")
MESH_FOLDERS = ("meshes", "mesh", "assets")
MAX_ABOVE = 6  # folders above a file that are looked at
PACKAGE = re.compile(r"^(?:package|model):///?([^/]+)/(.*)$", re.DOTALL)
"""A reference into a ROS package: its name, and the path in it."""

Element: TypeAlias = ElementTree.Element

_DECLARED = re.compile(rb"""<\?xml\s[^>]*?\bencoding\s*=\s*["']([\w.:-]{1,40})["']""")
_WIDE = {
    **{codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"},
    **{b"<\0": "utf-16-le", b"\0<": "utf-16-be"},
}
"""Encodings that the first two bytes of a file show."""
_SLOW = ("idna", "punycode")
"""Python's codecs for host names, whose time is quadratic."""


class _Located(ElementTree.Element):
    """An element with the line of its start tag."""

    __slots__ = ("line",)

    line: int


def at_line(element: Element) -> str:
    """Return " (line 3)", where an element of a file begins, for messages."""
    line = getattr(element, "line", 0)
    return f" (line {line})" if line else ""


def read_xml(path: Path, *, only_utf8: bool = False) -> Element:
    """Parse one XML file into elements; see `parse_xml`.

    Raises:
        ConfigError: If the file is missing, too large, too deep or not plain XML.
    """
    data = read_bytes(path, most=MAX_BYTES)
    return parse_xml(data, source=str(path), only_utf8=only_utf8)


def parse_xml(data: bytes, *, source: str, only_utf8: bool = False) -> Element:
    """Parse XML in the encoding that it declares, one of Python's, into elements.

    A document type declaration is refused, because it can define entities that grow
    without bound or read other files. Namespace prefixes need no declaration. With
    `only_utf8`, text is refused that a reader of UTF-8, as MuJoCo is, would understand
    differently.

    Raises:
        ConfigError: If it is too deep, has too many elements or is not plain XML.
    """
    stripped = data.lstrip()
    text = _decoded(stripped, source)
    content = text.encode("utf-8")
    if only_utf8 and content != stripped.removeprefix(codecs.BOM_UTF8):
        raise ConfigError(
            f"{source}: it is not in UTF-8, as MuJoCo needs it. Save it in UTF-8."
        )
    before = data[: len(data) - len(stripped)].count(b"\n")
    parser = expat.ParserCreate("utf-8")
    builder = ElementTree.TreeBuilder(_Located)
    depth = count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > MAX_DEPTH:
            raise ConfigError(
                f"{source}: elements are nested deeper than {MAX_DEPTH} levels."
            )
        if count > MAX_ELEMENTS:
            raise ConfigError(f"{source}: it has more than {MAX_ELEMENTS} elements.")
        element = cast("_Located", builder.start(tag, attributes))
        element.line = parser.CurrentLineNumber + before

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_: object) -> None:
        raise ConfigError(
            f"{source}: a document type declaration (<!DOCTYPE ...>) is not allowed, "
            "because it can read other files. Remove it."
        )

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        reason, line = expat.ErrorString(error.code), error.lineno + before
        raise ConfigError(
            f"{source}: not well-formed XML: {reason} (line {line})."
        ) from error
    return builder.close()


def _decoded(data: bytes, source: str) -> str:
    """Return the text of a file without a byte order mark; raises ConfigError."""
    declared = _DECLARED.match(data)
    name = _WIDE.get(data[:2]) or (declared[1].decode() if declared else "utf-8")
    try:
        if codecs.lookup(name).name in _SLOW:
            raise LookupError(name)
        text = data.removeprefix(codecs.BOM_UTF8).decode(name)
        text.encode("utf-8")  # some codecs make halves of characters
        if declared and not text.startswith("<?xml"):
            raise UnicodeError("it is in another one")
    except LookupError as error:
        raise ConfigError(
            f"{source}: it declares the encoding '{name}', which is unknown. Save it "
            "in UTF-8, and declare that."
        ) from error
    except UnicodeError as error:
        raise ConfigError(
            f"{source}: it cannot be read as '{name}', the encoding that it "
            f"{'declares' if declared else 'has by default'}: {error}."
        ) from error
    return text


def model_root(file: Path, references: Iterable[str]) -> Path:
    """Return the folder whose files a robot file may refer to.

    This is the ROS package around the file, or else the outermost of a close folder
    with meshes, the folder above `urdf` and the like, and one of `COLLECTIONS` further
    up; or the folder of that name around them if a reference is `package://NAME/...`.
    """
    folder, *above = real_path(file).parents
    close = (folder, *above[:3])
    package = next((p for p in close if (p / "package.xml").is_file()), None)
    holder = (p for p in close if any((p / m).is_dir() for m in MESH_FOLDERS))
    inside_one = folder.name.lower() in ROBOT_FOLDERS
    outer = (p for p in close[1:] if p.name.lower() in COLLECTIONS)
    found = (folder.parent if inside_one else folder, next(holder, folder), *outer)
    root = package or min(found, key=lambda p: len(p.parts))
    packages = {PACKAGE.sub(r"\1", name) for name in references if PACKAGE.match(name)}
    named = (p for p in above[:MAX_ABOVE] if p.name in packages)
    return next((p for p in named if root.is_relative_to(p)), root)


def package_folder(name: str, file: Path) -> Path | None:
    """Return the folder of a ROS package: around or beside a file, or where ROS looks.

    ROS 1 looks in the folders of `ROS_PACKAGE_PATH` and in those inside them, ROS 2 in
    `share` of each prefix of `AMENT_PREFIX_PATH`. One beside the file, or beside one of
    the folders around it, has a `package.xml` or a folder of meshes.
    """
    if not re.fullmatch(r"\w[\w.-]*", name):
        return None
    above = real_path(file).parents[:MAX_ABOVE]
    folders = [folder for folder in above if folder.name == name]
    folders += [beside for folder in above if is_package(beside := folder / name)]
    folders += [prefix / "share" / name for prefix in _paths_in("AMENT_PREFIX_PATH")]
    for path in _paths_in("ROS_PACKAGE_PATH"):
        folders += (
            [path] if path.name == name else [path / name, *path.glob(f"*/{name}")]
        )
    return next((folder for folder in folders if folder.is_dir()), None)


def is_package(folder: Path) -> bool:
    """Whether a folder has a `package.xml`, or a folder of meshes."""
    meshes = any((folder / name).is_dir() for name in MESH_FOLDERS)
    return meshes or (folder / "package.xml").is_file()


def _paths_in(variable: str) -> list[Path]:
    """Return the folders that an environment variable lists."""
    return [Path(x) for x in os.environ.get(variable, "").split(os.pathsep) if x]


def real_path(path: Path) -> Path:
    """Return a path with resolved links, also if these form a loop."""
    return Path(os.path.realpath(path))


def inside(root: Path, path: Path, *, source: Path) -> Path:
    """Return a path with resolved links; raises ConfigError outside of a folder."""
    resolved, root = real_path(path), real_path(root)
    if not resolved.is_relative_to(root):
        common = Path(os.path.commonpath([root, resolved]))
        wider = f", or allow both by --mesh-root {common}" * bool(common.name)
        raise ConfigError(
            f"{source}: the file '{resolved}' lies outside the folder {root} and is "
            f"not read. Copy it into that folder{wider}."
        )
    return resolved
