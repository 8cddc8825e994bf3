"""Read XML files from outside: no entities, no other files, size and depth limited."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

from wbc_suite.errors import ConfigError

__all__ = ["children", "inside", "read_xml"]

MAX_BYTES = 8_000_000
"""Largest XML file that is read; large humanoids have about 200 kB."""
MAX_DEPTH = 400
"""Deepest nesting; MJCF nests bodies, one level for each link of a chain."""

Element = ElementTree.Element


def read_xml(path: Path) -> Element:
    """Parse one XML file into elements.

    A document type declaration is refused, for it is how entities come in, which may
    grow without bound or name other files. Prefixes of namespaces need no declaration:
    vendors' files forget it.

    Raises:
        ConfigError: If the file is missing, too large, too deep or no plain XML.
    """
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise ConfigError(
                f"{path}: {size} bytes, more than the {MAX_BYTES} that a robot's XML "
                "may have. Is this the right file?"
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
                f"{self._path}: elements are nested more than {MAX_DEPTH} deep."
            )
        self._builder.start(tag, attributes)

    def _end(self, tag: str) -> None:
        self._depth -= 1
        self._builder.end(tag)

    def _refuse(self, *_: object) -> None:
        raise ConfigError(
            f"{self._path}: a document type declaration (<!DOCTYPE ...>) is not "
            "allowed: it could pull in other files. Remove it."
        )


def children(element: Element, tag: str) -> Iterator[Element]:
    """Yield the direct children with a tag."""
    return (child for child in element if child.tag == tag)


def inside(root: Path, path: Path, *, source: Path) -> Path:
    """Return a path with all links followed, if it lies in a folder.

    Raises:
        ConfigError: If the path leaves the folder.
    """
    resolved = path.resolve()
    if not resolved.is_relative_to(root.resolve()):
        raise ConfigError(
            f"{source}: the file '{path}' lies outside the folder {root.resolve()}: "
            "nothing outside it is read. Copy it below that folder and name it there."
        )
    return resolved
