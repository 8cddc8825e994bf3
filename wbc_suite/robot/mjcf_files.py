"""Compile an MJCF file from outside, after a look at what it would read and do."""

from pathlib import Path
from xml.etree import ElementTree

import mujoco

from wbc_suite.errors import ConfigError, DescriptionError
from wbc_suite.robot.mjcf_limits import check_file, check_size
from wbc_suite.robot.xml_files import inside, read_xml

__all__ = ["compile_mjcf", "read_mjcf_spec"]

MAX_FILES = 50
"""Most XML files that may include one another."""

Element = ElementTree.Element


def compile_mjcf(path: Path) -> mujoco.MjModel:
    """Compile an MJCF file and all that it includes from its own folder.

    Raises:
        ConfigError: If it is no MJCF, or names a file outside its folder.
        DescriptionError: If MuJoCo refuses it.
    """
    return _read(path)[1]


def read_mjcf_spec(path: Path) -> mujoco.MjSpec:
    """Read an MJCF file as `compile_mjcf` does, for other models to take in.

    Raises:
        ConfigError: If it is no MJCF, or names a file outside its folder.
        DescriptionError: If MuJoCo refuses it.
    """
    return _read(path)[0]


def _read(path: Path) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    roots = _included(path)
    check_size(roots, path)
    for element in roots:
        if (
            element.find("extension") is not None
            or element.find(".//plugin") is not None
        ):
            raise DescriptionError(f"{path}: plugins run code; they are not loaded.")
        _check_files(element, path)
        _check_numbers(element, path)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        return spec, spec.compile()
    except (ValueError, RuntimeError, MemoryError) as error:  # it has all three
        raise DescriptionError(f"{path}: MuJoCo refuses it: {error}") from error


def _included(path: Path) -> list[Element]:
    """Read a file and those that it includes."""
    roots: dict[Path, Element] = {}
    waiting = [path]
    while waiting:
        file = waiting.pop()
        resolved = inside(path.parent, file, source=path)
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
        named = [
            e.get("file", "") for tag in ("include", "model") for e in root.iter(tag)
        ]
        waiting += [path.parent / name for name in named]
    return list(roots.values())


def _check_files(root: Element, path: Path) -> None:
    """Refuse meshes, textures and the like from outside the folder."""
    keys = ("meshdir", "texturedir", "assetdir")
    folders = [e.get(key, "") for e in root.iter("compiler") for key in keys]
    for element in root.iter():
        for key, name in element.items():
            if key.startswith("file") and name:
                for folder in ("", *filter(None, folders)):
                    file = path.parent / folder / name
                    check_file(inside(path.parent, file, source=path), source=path)


def _check_numbers(root: Element, path: Path) -> None:
    """Refuse what is not a number; MuJoCo would only print a warning."""
    for element in root.iter():
        for key, value in element.items():
            if key not in ("name", "file") and "nan" in value.lower().split():
                raise DescriptionError(
                    f'{path}: <{element.tag} {key}="{value:.80}"> holds what is no '
                    "number."
                )
