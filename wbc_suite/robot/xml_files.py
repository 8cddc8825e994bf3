"""Read XML files from untrusted sources: no entities, limited size and depth."""

from pathlib import Path
from typing import TypeAlias
from xml.etree import ElementTree
from xml.parsers import expat

from wbc_suite.errors import ConfigError

MAX_BYTES = 8_000_000
"""Largest XML file that is read; large humanoids have about 200 kB."""
MAX_DEPTH = 400
"""Largest nesting depth; MJCF nests one body per link of a chain."""

Element: TypeAlias = ElementTree.Element


def read_xml(path: Path) -> Element:
    """Parse one XML file into elements.

    A document type declaration is refused, because it can define entities that grow
    without bound or read other files. Namespace prefixes need no declaration, which
    vendors' files often omit.

    Raises:
        ConfigError: If the file is missing, too large, too deep or not plain XML.
    """
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise ConfigError(
                f"{path}: the file has {size} bytes; at most {MAX_BYTES} are read. Is "
                "this the right file?"
            )
        data = path.read_bytes()
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}).") from error
    return _Reader(path).read(data)


class _Reader:
    """Builds elements from expat's events."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._depth = 0
        self._builder = ElementTree.TreeBuilder()

    def read(self, data: bytes) -> Element:
        parser = expat.ParserCreate()
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.StartDoctypeDeclHandler = self._refuse
        try:
            parser.Parse(data, True)
        except expat.ExpatError as error:
            raise ConfigError(f"{self._path}: not well-formed XML: {error}.") from error
        return self._builder.close()

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise ConfigError(
                f"{self._path}: elements are nested deeper than {MAX_DEPTH} levels."
            )
        self._builder.start(tag, attributes)

    def _end(self, tag: str) -> None:
        self._depth -= 1
        self._builder.end(tag)

    def _refuse(self, *_: object) -> None:
        raise ConfigError(
            f"{self._path}: a document type declaration (<!DOCTYPE ...>) is not "
            "allowed, because it can read other files. Remove it."
        )


def inside(root: Path, path: Path, *, source: Path) -> Path:
    """Return a path with resolved links, if it lies in a folder.

    Raises:
        ConfigError: If the path lies outside the folder.
    """
    resolved = path.resolve()
    if not resolved.is_relative_to(root.resolve()):
        raise ConfigError(
            f"{source}: the file '{path}' lies outside the folder {root.resolve()} and "
            "is not read. Copy it into that folder."
        )
    return resolved
