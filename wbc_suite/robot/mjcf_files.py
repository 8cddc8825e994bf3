"""Read an MJCF model with all files that it names, before MuJoCo opens them.

Names lead to files as in MuJoCo: from the folder of the model, which is its own for an
attached one, with `meshdir` or `texturedir` of its `<compiler>` between; and if there
is none, from the folder of the included file that has the name.
"""

import math
import struct
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from wbc_suite.errors import ConfigError, DescriptionError
from wbc_suite.files import open_file
from wbc_suite.robot.xml_files import Element, at_line, inside, read_xml, real_path

MAX_FILES = 50
"""Largest number of XML files of a model; what is attached twice counts twice."""
MAX_READ, MAX_BYTES = 100_000, 32_000_000  # elements and bytes in all of them
MAX_FILE = 200_000_000  # largest mesh or picture file, bytes
MAX_PIXELS = 20_000_000  # of a picture; 60 MB as RGB

ARCHIVES = (".zip", ".mjz")  # MuJoCo unpacks them, whatever their size
_FOLDERS = {"texture": "texturedir", "include": "", "model": ""}
"""Keys of `<compiler>` with the folder of what an element names, else `meshdir`."""
_PNG = b"\x89PNG\r\n\x1a\n"


class Model(NamedTuple):
    """A model as MuJoCo reads it.

    Attributes:
        root: Its elements; included ones are below their `<include>`.
        attached: The models of its `<model>`, by name.
        files: Number of its XML files, with those of attached models.
    """

    root: Element
    attached: "dict[str, Model]"
    files: int


class ModelFiles:
    """Reads the model of a path, whose files lie in one folder."""

    def __init__(self, path: Path, folder: Path) -> None:
        self._path, self._file, self._folder = path, real_path(path), folder
        self._origins: dict[Element, Path] = {}
        self._models: dict[Path, Model] = {}
        self._open: list[Path] = []
        self._bytes = 0
        self._strips = False  # by the outermost model, also files of attached ones

    def read(self) -> Model:
        """Read the model, and check that what it names may be read.

        Raises:
            ConfigError: If a file is missing, not MJCF, outside of the folder, or
                includes or attaches itself, or there are too many.
            DescriptionError: If a mesh or a picture is too large.
        """
        return self._read(self._file)

    def _read(self, file: Path) -> Model:
        if file not in self._models:
            with self._opened(file) as root:
                self._models[file] = self._model(root, file)
        return self._models[file]

    def where(self, element: Element) -> str:
        """Return file, tag and line of an element, for messages."""
        file = self._shown(self._origins[element])
        return f"{file}: <{element.tag}>{at_line(element)}"

    def _shown(self, file: Path) -> Path:
        return self._path if file == self._file else file

    @contextmanager
    def _opened(self, file: Path) -> Generator[Element]:
        if file in self._open:
            raise ConfigError(f"{self._path}: '{file}' includes or attaches itself.")
        if len(self._open) >= MAX_FILES:
            raise self._too_many()
        root = read_xml(self._shown(file), only_utf8=True)
        self._origins.update(dict.fromkeys(root.iter(), file))
        self._bytes += file.stat().st_size
        if len(self._origins) > MAX_READ or self._bytes > MAX_BYTES:
            raise ConfigError(
                f"{self._path}: it and what it includes have more than {MAX_READ} "
                f"elements or {MAX_BYTES} bytes."
            )
        self._open.append(file)
        yield root
        self._open.pop()

    def _too_many(self) -> ConfigError:
        return ConfigError(
            f"{self._path}: it includes or attaches more than {MAX_FILES} files."
        )

    def _model(self, root: Element, file: Path) -> Model:
        if root.tag != "mujoco":
            hint = " It looks like URDF: name it .urdf." * (root.tag == "robot")
            raise ConfigError(
                f"{self._shown(file)}: an MJCF file begins with <mujoco>, not "
                f"<{root.tag}>.{hint}"
            )
        files, attached = 1 + self._include(root, file.parent), dict[str, Model]()
        folders, strips = _directories(root)
        if len(self._open) == 1:
            self._strips = strips
        for element in root.iter():
            below = folders[_FOLDERS.get(element.tag, "meshdir")]
            # a flexcomp reads its file before its model is attached
            own = strips if element.tag == "flexcomp" else self._strips
            own = own and element.tag != "model"
            keys = [key for key in element.attrib if key.startswith("file")]
            for key in keys if element.tag.lower() != "include" else ():
                paths = self._paths(element, key, file.parent, below, strips=own)
                if element.tag == "model":
                    models = [self._read(path) for path in paths]
                    files += max(model.files for model in models)
                    for model in models:
                        name = model.root.get("model", "MuJoCo Model")
                        attached[element.get("name", name)] = model
                else:
                    for path in paths:
                        self._check_file(path, element)
            if files > MAX_FILES:
                raise self._too_many()
        return Model(root, attached, files)

    def _include(self, root: Element, folder: Path) -> int:
        """Put what is included below the elements that name it; return its number."""
        count = 0
        # MuJoCo does not mind the case of this tag
        for element in [e for e in root.iter() if e.tag.lower() == "include"]:
            path = self._paths(element, "file", folder, "", strips=False)[0]
            with self._opened(path) as inner:
                count += 1 + self._include(inner, folder)
                element.extend(inner)
            if count > MAX_FILES:
                raise self._too_many()
        return count

    def _paths(
        self, element: Element, key: str, folder: Path, below: str, *, strips: bool
    ) -> list[Path]:
        """Return the files that MuJoCo may open for a name, the first of them first.

        If there is none, it is the last one that MuJoCo looks for.
        """
        source = self._origins[element]
        name = element.get(key, "").replace("\\", "/")
        if strips:
            name = name.rpartition("/")[2]
        place = _joined(below.replace("\\", "/"), name)
        parts = place.lower().split("/")
        if ":" in place or any(part.endswith(ARCHIVES) for part in parts):
            raise ConfigError(
                f"{self.where(element)} names '{place}', which is no plain file: links "
                "to other places and archives are not read."
            )
        paths = [_reduced(_joined(str(folder), place))]
        if not strips:
            paths.append(_reduced(_joined(str(source.parent), name)))
        found = [path for path in dict.fromkeys(paths) if _exists(path)] or paths[-1:]
        return [
            inside(self._folder, path, source=self._shown(source)) for path in found
        ]

    def _check_file(self, file: Path, element: Element) -> None:
        """Refuse what is no regular file, or has too many bytes or pixels."""
        if not _exists(file):
            return  # MuJoCo reports a missing file
        try:
            with open_file(file, most=MAX_FILE) as stream:
                head = stream.read(24)
        except ConfigError as error:
            raise DescriptionError(f"{self.where(element)}: {error}") from error
        pixels = 0
        if head.startswith(_PNG) and len(head) == 24:
            pixels = math.prod(struct.unpack(">II", head[16:]))
        if pixels > MAX_PIXELS:
            raise DescriptionError(
                f"{self.where(element)}: '{file.name}' has {pixels} pixels; at most "
                f"{MAX_PIXELS} are allowed."
            )


def _directories(root: Element) -> tuple[dict[str, str], bool]:
    """Return `meshdir` and `texturedir` of a model, and whether it strips names."""
    folders, strips = {"meshdir": "", "texturedir": "", "": ""}, False
    for compiler in root.iter("compiler"):
        both = compiler.get("assetdir")
        if both is not None:
            folders |= {"meshdir": both, "texturedir": both}
        for key in ("meshdir", "texturedir"):
            folders[key] = compiler.get(key, folders[key])
        strips = compiler.get("strippath", str(strips)).lower() == "true"
    return folders, strips


def _exists(path: Path) -> bool:
    try:
        path.stat()
    except (OSError, ValueError):
        return False
    return True


def _joined(folder: str, name: str) -> str:
    if name.startswith("/") or not folder:
        return name
    return f"{folder.removesuffix('/')}/{name}"


def _reduced(path: str) -> Path:
    """Remove `.` and `..` from an absolute path as MuJoCo does, before links count."""
    parts: list[str] = []
    for part in path[1:].split("/"):
        if part == ".." and parts and parts[-1] != "..":
            parts.pop()
        elif part != ".":
            parts.append(part)
    return Path("/" + "/".join(parts))
