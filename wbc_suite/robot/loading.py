"""`load_robot`: from a catalogue name or a file to a `RobotDescription`."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Literal

from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot.assembly import assemble, describe_component
from wbc_suite.robot.choosing import Choice
from wbc_suite.robot.component import Component, read_robot_file
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.skins import Wardrobe

__all__ = ["load_robot"]

FOLDERS = ("gripper", "base", "arm", "body")


def load_robot(
    name: str | Path,
    *,
    gripper: Choice = None,
    base: Choice = None,
    root: Literal["fixed", "planar", "free"] | None = None,
    skin: str | Path | None = None,
    catalogue: Catalogue | None = None,
) -> RobotDescription:
    """Load a robot by its catalogue name, or from a TOML, URDF or MJCF file.

    Args:
        name: Catalogue name without regard to case (`Panda`, `gr1`), a component with
            its folder (`gripper/panda_gripper`), or a path to a .toml, .urdf or .xml.
        gripper: Another gripper for every side, or one for each: `{"right": ...}`;
            "none" leaves it out, and puts `tcp` at the flange. `InspireHand` is the one
            of each side; a name that ends in .toml is a file.
        base: Another base, which brings its own root and height; "none" leaves it out.
            A robot with legs or wheels takes only a root, such as `NullMobileBase`.
        root: Another root: `fixed`, `planar` or `free`.
        skin: "meshes" draws the robot with the meshes of installed packages, a folder
            with those found there; see `robot.skins`. Nothing else changes.
        catalogue: Where to look; our own catalogue by default.

    Raises:
        UnknownNameError: If the catalogue has no such robot, gripper or base.
        DescriptionError: If the description contradicts itself or physics.
        ConfigError: If the file cannot be read.
    """
    catalogue = catalogue or Catalogue()
    # Callers without a type checker are answered in words.
    if not isinstance(catalogue, Catalogue):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise ConfigError(f"load_robot: {catalogue!r:.60} is no Catalogue.")
    if not isinstance(name, str | Path):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise UnknownNameError("robot", name, catalogue.called("robots"))
    path = _locate(str(name), catalogue)
    wardrobe = None if skin is None else Wardrobe(skin, catalogue)
    robot = _read(path, catalogue, gripper=gripper, base=base, wardrobe=wardrobe)
    if wardrobe is not None:
        wardrobe.report()
    return robot if root in (None, robot.root.kind) else robot.with_root(root)


def _locate(name: str, catalogue: Catalogue) -> Path:
    path = Path(name)
    if path.suffix in (".toml", ".urdf", ".xml", ".mjcf"):
        if not path.is_file():
            raise ConfigError(f"{path}: no such file.")
        return path
    folder, _, stem = name.rpartition("/")
    if folder:
        if folder not in FOLDERS:
            raise UnknownNameError("kind of component", folder, FOLDERS)
        return catalogue.find(f"robots/{folder}", stem, kind=folder)
    try:
        return catalogue.find("robots", stem, kind="robot")
    except UnknownNameError as error:
        raise UnknownNameError(
            "robot", name, [*_components(stem, catalogue)] or error.known
        ) from None


def _components(name: str, catalogue: Catalogue) -> Iterator[str]:
    """Return the components of a name that no robot has, as `load_robot` takes them."""
    for folder in FOLDERS:
        with suppress(UnknownNameError):
            catalogue.find(f"robots/{folder}", name, kind=folder)
            yield f"{folder}/{name}"


def _read(
    path: Path,
    catalogue: Catalogue,
    *,
    gripper: Choice,
    base: Choice,
    wardrobe: Wardrobe | None,
) -> RobotDescription:
    if path.suffix == ".toml":
        content = read_robot_file(path)
        if not isinstance(content, Component):
            return assemble(
                path,
                catalogue=catalogue,
                gripper=gripper,
                base=base,
                wardrobe=wardrobe,
            )
        robot = describe_component(content, source=str(path), wardrobe=wardrobe)
    elif path.suffix == ".urdf":
        from wbc_suite.robot.urdf_import import read_urdf

        robot = read_urdf(path)
    else:
        from wbc_suite.robot.mjcf_import import read_mjcf

        robot = read_mjcf(path)
    if gripper is not None or base is not None:
        raise ConfigError(f"{path}: 'gripper' and 'base' need an assembly file.")
    return robot
