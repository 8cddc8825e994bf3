"""Write a robot for one reader: its URDF dialect, and the files beside it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import UrdfRoot
from wbc_suite.robot.readers.drake import write_drake
from wbc_suite.robot.readers.files import file_stem, write_text
from wbc_suite.robot.readers.isaac import write_isaac
from wbc_suite.robot.readers.ros2 import write_ros2
from wbc_suite.robot.readers.srdf import write_srdf
from wbc_suite.robot.urdf_export import Dialect, urdf_text, urdf_tree

Reader: TypeAlias = Literal["pybullet", "ros2", "isaac", "drake", "pinocchio"]

OWN: Mapping[str, UrdfRoot] = {"fixed": "fixed", "planar": "planar", "free": "none"}
"""Joint to the world by kind of root, for readers that free a first link themselves."""
LEFT: Mapping[str, UrdfRoot] = {"fixed": "fixed", "planar": "none", "free": "none"}
"""The same for readers that have planar and free roots themselves."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ReaderExport:
    """How files for a reader are written, and what its root is by kind of root.

    `write` takes robot, folder and root, and returns how the files are loaded.
    """

    roots: Mapping[str, UrdfRoot]
    write: Callable[[RobotDescription, Path, UrdfRoot], str]


def export_for(
    robot: RobotDescription,
    reader: Reader,
    folder: Path,
    *,
    root: UrdfRoot | None = None,
) -> str:
    """Write a robot's files for a reader into a folder; return how they are loaded.

    Args:
        robot: The robot.
        reader: Who reads the files.
        folder: Where they are written; it is made.
        root: Joint between the world and the first link. By default a fixed robot is
            fixed, a free one is left to the reader, and a planar root is three joints,
            or left to readers that have such a root themselves.
    """
    export = EXPORTS[reader]
    return export.write(robot, folder, root or export.roots[robot.root.kind])


def _pybullet(robot: RobotDescription, folder: Path, root: UrdfRoot) -> str:
    """Write a URDF in which each link has a mass: PyBullet takes 1 kg for absent ones.

    Links with mass 0 are weightless there; a first link with mass 0 is fixed.
    """
    dialect = Dialect(planar=False, capsule="capsule", light=0.0)
    name = f"{file_stem(robot)}.urdf"
    tree = urdf_tree(robot, dialect, mesh_dir=folder / "meshes", root=root)
    write_text(folder / name, urdf_text(tree))
    return (
        f'pybullet.loadURDF("{folder / name}", '
        "flags=pybullet.URDF_USE_INERTIA_FROM_FILE)\n"
        "PyBullet reads no mimic joints, gains or rotor inertias."
    )


def _pinocchio(robot: RobotDescription, folder: Path, root: UrdfRoot) -> str:
    """Write a URDF, and an SRDF with postures, rotor inertias and disabled pairs."""
    urdf, srdf = (folder / f"{file_stem(robot)}.{kind}" for kind in ("urdf", "srdf"))
    tree = urdf_tree(robot, Dialect(), mesh_dir=folder / "meshes", root=root)
    write_text(urdf, urdf_text(tree))
    write_text(srdf, write_srdf(robot, rooted=root != "none", pinocchio=True))
    own = {"planar": "Planar", "free": "FreeFlyer"}.get(robot.root.kind, "FreeFlyer")
    joint = f", pin.JointModel{own}()" if root == "none" else ""
    return (
        f'model = pin.buildModelFromUrdf("{urdf}"{joint})\n'
        f'pin.loadReferenceConfigurations(model, "{srdf}")\n'
        f'pin.loadRotorParameters(model, "{srdf}")'
    )


EXPORTS: dict[Reader, ReaderExport] = {
    "pybullet": ReaderExport(roots=OWN, write=_pybullet),
    "ros2": ReaderExport(roots=LEFT, write=write_ros2),
    "isaac": ReaderExport(roots=OWN, write=write_isaac),
    "drake": ReaderExport(roots=OWN, write=write_drake),
    "pinocchio": ReaderExport(roots=LEFT, write=_pinocchio),
}
"""How each reader's files are written."""
