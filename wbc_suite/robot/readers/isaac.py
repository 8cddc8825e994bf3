"""Write a robot as URDF for Isaac's importer, and as MJCF, which becomes USD.

Source: the parser of isaacsim.asset.importer.urdf. It refuses planar roots, and reads
the elements `fixed_frame`, `sensor` and `capsule`.
"""

from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import UrdfRoot
from wbc_suite.robot.mjcf_export import write_mjcf
from wbc_suite.robot.poses import se3_of
from wbc_suite.robot.readers.files import file_stem, write_text
from wbc_suite.robot.urdf_export import (
    Dialect,
    numbers_text,
    origin,
    urdf_text,
    urdf_tree,
)

NEGLIGIBLE = 1e-5
"""kg; the importer's own mass that changes nothing but is not taken as none
(kNegligibleMass). It gives links without mass that of a density."""
NEAR, FAR = 0.01, 100.0
"""Distances between which cameras see, m; MuJoCo's of a model of 2 m extent."""

DIALECT = Dialect(planar=False, capsule="capsule", frames=False, light=NEGLIGIBLE)


def write_isaac(robot: RobotDescription, folder: Path, root: UrdfRoot) -> str:
    """Write a URDF with frames and cameras, and an MJCF with armature and gains."""
    tree = urdf_tree(robot, DIALECT, mesh_dir=folder / "meshes", root=root)
    for frame in robot.frames:
        element = Element("fixed_frame", name=frame.name)
        SubElement(element, "parent", link=frame.link)
        element.append(origin(se3_of(frame)))
        tree.append(element)
    tree.extend(_cameras(robot))
    urdf, mjcf = (folder / f"{file_stem(robot)}.{kind}" for kind in ("urdf", "xml"))
    write_text(urdf, urdf_text(tree))
    write_text(mjcf, write_mjcf(robot, mesh_dir=folder / "mjcf_meshes"))
    return (
        f"Isaac Sim: File > Import > {urdf}, with moveable base for free robots.\n"
        "USD with armature and gains, in an environment of its own (its MuJoCo is "
        f"older):\npip install mujoco-usd-converter && mujoco_usd_converter {mjcf} "
        f"{folder / 'usd'}"
    )


def _cameras(robot: RobotDescription) -> Iterator[Element]:
    """Yield sensors; a camera of USD looks along -z with y up, as MuJoCo's."""
    for camera in robot.cameras:
        width, height = camera.resolution
        half = np.radians(camera.fovy) / 2
        hfov = 2.0 * np.arctan(np.tan(half) * width / height)
        element = Element("sensor", name=camera.name, type="camera")
        SubElement(element, "parent", link=camera.link)
        element.append(origin(se3_of(camera)))
        image = {
            "width": str(width),
            "height": str(height),
            "hfov": numbers_text(hfov),
            "near": numbers_text(NEAR),
            "far": numbers_text(FAR),
        }
        SubElement(SubElement(element, "camera"), "image", image)
        yield element
