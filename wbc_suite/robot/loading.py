"""`load_robot`: read a robot from the catalogue or from a TOML, URDF or MJCF file."""

from pathlib import Path
from typing import Literal

from wbc_suite import logs
from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError, DescriptionError, UnknownNameError
from wbc_suite.robot.assembly import assemble, describe_component
from wbc_suite.robot.component_choice import Choice
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.dressing import dress
from wbc_suite.robot.mesh_files import MODELS
from wbc_suite.robot.named_files import named_file
from wbc_suite.robot.robot_file import Component, read_robot_file
from wbc_suite.robot.skins import PLAIN, SkinFinder, read_model
from wbc_suite.typing import RobotName

LOG = logs.logger(__name__)

URDF = (".urdf", ".xacro")
FOLDERS = ("gripper", "base", "arm", "body")


def load_robot(
    name: RobotName | str | Path,
    *,
    gripper: Choice = None,
    base: Choice = None,
    root: Literal["fixed", "planar", "free"] | None = None,
    skin: str | Path | None = None,
    mesh_root: str | Path | None = None,
    strict: bool = False,
    catalogue: Catalogue | None = None,
) -> RobotDescription:
    """Load a robot by its catalogue name, or from a TOML, URDF or MJCF file.

    Args:
        name: Catalogue name, ignoring case (`Panda`, `gr1`), a component with its
            folder (`gripper/panda_gripper`), a path to a .toml, .urdf, .xacro or .xml,
            or the name of a file in a collection (`menagerie:unitree_g1`), see
            `robot.named_files`.
        gripper: Another gripper for every side, or one per side: `{"right": ...}`;
            "none" leaves it out and puts `tcp` at the flange. `InspireHand` stands for
            the hand of each side. A name that ends in .toml, .urdf or .xml is a file;
            the last two are those of a hand alone.
        base: Another base with its own root and height; "none" leaves it out. A robot
            with legs or wheels accepts only a base without body (`NullMobileBase`).
        root: Another root: `fixed`, `planar` or `free`. A URDF that does not connect
            its first link to a link `world` is free if it has four feet or more, else
            fixed. A free robot that has hands, but no feet, is planar.
        skin: "meshes" draws the robot with meshes of installed packages; a folder with
            those found there; a URDF or MJCF file of the same robot with its meshes,
            see `robot.dressing`. A robot from a URDF or MJCF file is drawn with its
            own meshes, and with hulls of these by "none". Physics does not change.
        mesh_root: Folder that a URDF or MJCF file may read meshes from; by default the
            package or model folder around it.
        strict: Refuse a URDF or MJCF file with faults that are mended with a warning
            otherwise.
        catalogue: Where names are looked up; by default the package's catalogue.

    Raises:
        UnknownNameError: If the catalogue has no such robot, gripper or base.
        DescriptionError: If the description is inconsistent or unphysical.
        ConfigError: If the file cannot be read.
    """
    catalogue = catalogue or Catalogue()
    # Checked at run time for callers without a type checker.
    if not isinstance(catalogue, Catalogue):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise ConfigError(
            f"load_robot: 'catalogue' must be a Catalogue, not {catalogue!r:.60}."
        )
    if not isinstance(name, str | Path):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise UnknownNameError("robot", name, catalogue.called("robots"))
    path = _locate(str(name), catalogue)
    model = _model(skin)
    if model is not None:
        robot = load_robot(
            name,
            gripper=gripper,
            base=base,
            root=root,
            skin=PLAIN,
            mesh_root=mesh_root,
            strict=strict,
            catalogue=catalogue,
        )
        return _dressed(robot, model)
    if path.suffix == ".toml":
        skins = None if skin in (None, PLAIN) else SkinFinder(skin, catalogue)
        robot = _read(path, catalogue, gripper=gripper, base=base, skins=skins)
        if skins is not None:
            skins.report_missing()
    elif gripper is not None or base is not None:
        raise ConfigError(f"{path}: 'gripper' and 'base' need an assembly file.")
    else:
        robot = _import(path, skin, mesh_root=mesh_root, strict=strict)
    if root not in (None, robot.root.kind):
        robot = robot.with_root(root)
    if robot.root.kind == "free" and robot.wheels:
        from wbc_suite.robot.wheel_rollers import with_rollers

        robot = with_rollers(robot)
    if path.suffix == ".toml" or robot.root.kind != "free":
        return robot
    return _standing(robot, path, asked=root == "free")


def _model(skin: str | Path | None) -> Path | None:
    """Return a skin that is a model file."""
    path = named_file(str(skin)) or Path(skin or "")
    return path if path.suffix.lower() in MODELS and path.is_file() else None


def _dressed(robot: RobotDescription, model: Path) -> RobotDescription:
    drawn = dress(robot, read_model(model))
    if not drawn:
        raise ConfigError(f"skin: {model} has no meshes for '{robot.name}'.")
    return robot.model_copy(update={"skins": drawn})


def _standing(robot: RobotDescription, path: Path, *, asked: bool) -> RobotDescription:
    """Return a free robot with soles, or with another root if it cannot stand.

    One whose free root is `asked` for keeps it.
    """
    from wbc_suite.robot.adopt.importing import with_soles

    feet = any(frame.role == "foot" for frame in robot.frames)
    if robot.hands and not feet and not asked:
        LOG.warning("%s: a free robot without feet; its root is made planar.", path)
        return robot.with_root("planar")
    try:
        return with_soles(robot)
    except DescriptionError as error:
        if asked or path.suffix.lower() not in URDF:
            raise
        LOG.warning("%s Its root is made fixed.", error)
        return robot.with_root("fixed")


def _locate(name: str, catalogue: Catalogue) -> Path:
    path = named_file(name) or Path(name)
    if path.suffix.lower() in (".toml", *URDF, ".xml", ".mjcf"):
        if not path.is_file():
            raise ConfigError(f"{path}: the file does not exist.")
        return path
    folder, _, stem = name.rpartition("/")
    if folder:
        if folder not in FOLDERS:
            raise UnknownNameError("kind of component", folder, FOLDERS)
        return catalogue.find(f"robots/{folder}", stem, kind=folder)
    try:
        return catalogue.find("robots", stem, kind="robot")
    except UnknownNameError as error:
        folders = (f for f in FOLDERS if catalogue.holds(f"robots/{f}", stem))
        components = [f"{folder}/{stem}" for folder in folders]
        raise UnknownNameError("robot", name, components or error.known) from None


def _read(
    path: Path,
    catalogue: Catalogue,
    *,
    gripper: Choice,
    base: Choice,
    skins: SkinFinder | None,
) -> RobotDescription:
    content = read_robot_file(path, catalogue)
    if not isinstance(content, Component):
        return assemble(
            path, catalogue=catalogue, gripper=gripper, base=base, skins=skins
        )
    if gripper is not None or base is not None:
        raise ConfigError(f"{path}: 'gripper' and 'base' need an assembly file.")
    return describe_component(content, source=str(path), skins=skins)


def _import(
    path: Path,
    skin: str | Path | None,
    *,
    mesh_root: str | Path | None,
    strict: bool,
) -> RobotDescription:
    drawn = skin != PLAIN
    if path.suffix.lower() in URDF:
        from wbc_suite.robot.urdf_import import read_urdf as read
    else:
        from wbc_suite.robot.mjcf_import import read_mjcf as read
    robot = read(path, mesh_root=mesh_root, strict=strict, skin=drawn)
    if skin is not None and drawn and not robot.skins:
        raise ConfigError(f"{path}: skin: no link is drawn by meshes that were found.")
    return robot
