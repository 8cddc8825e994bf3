"""Read XML files from untrusted sources: no entities, limited size and depth."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import TypeAlias
from xml.etree import ElementTree
from xml.parsers import expat

from wbc_suite.errors import ConfigError
from wbc_suite.tomlfile import read_bytes

MAX_BYTES = 8_000_000
"""Largest XML file that is read; large humanoids have about 200 kB."""
MAX_DEPTH = 400  # largest nesting depth; MJCF nests one body per link of a chain

ROBOT_FOLDERS = ("urdf", "urdfs", "robots", "mjcf", "xml")
COLLECTIONS = (*ROBOT_FOLDERS, "descriptions", "models")
MESH_FOLDERS = ("meshes", "mesh", "assets")
MAX_ABOVE = 6  # folders above a file that are looked at
PACKAGE = re.compile(r"^(?:package|model):///?([^/]+)/.*$", re.DOTALL)

Element: TypeAlias = ElementTree.Element


def read_xml(path: Path) -> Element:
    """Parse one XML file into elements.

    A document type declaration is refused, because it can define entities that grow
    without bound or read other files. Namespace prefixes need no declaration.

    Raises:
        ConfigError: If the file is missing, too large, too deep or not plain XML.
    """
    parser, builder, depth = expat.ParserCreate(), ElementTree.TreeBuilder(), 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > MAX_DEPTH:
            raise ConfigError(
                f"{path}: elements are nested deeper than {MAX_DEPTH} levels."
            )
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_: object) -> None:
        raise ConfigError(
            f"{path}: a document type declaration (<!DOCTYPE ...>) is not allowed, "
            "because it can read other files. Remove it."
        )

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(read_bytes(path, most=MAX_BYTES).lstrip(), True)
    except expat.ExpatError as error:
        raise ConfigError(f"{path}: not well-formed XML: {error}.") from error
    return builder.close()


def model_root(file: Path, references: Iterable[str]) -> Path:
    """Return the folder whose files a robot file may refer to.

    This is the ROS package around the file, or else the outermost of a close folder
    with meshes, the folder above `urdf` and the like, and one of `COLLECTIONS` further
    up; or the folder of that name around them if a reference is `package://NAME/...`.
    """
    folder, *above = file.resolve().parents
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


def inside(root: Path, path: Path, *, source: Path) -> Path:
    """Return a path with resolved links; raises ConfigError outside of a folder."""
    resolved = path.resolve()
    if not resolved.is_relative_to(root.resolve()):
        raise ConfigError(
            f"{source}: the file '{path}' lies outside the folder {root.resolve()} and "
            "is not read. Copy it into that folder, or give a folder that encloses "
            "both by --mesh-root."
        )
    return resolved
