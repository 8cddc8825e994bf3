"""Labels of segmentations: elements, instances and classes of a scene."""

import re
from collections.abc import Sequence
from enum import StrEnum

import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.control import RobotState
from wbc_suite.sensing.hands import hands_of


class SegmentationLevel(StrEnum):
    """Granularity of a segmentation."""

    ELEMENT = "element"
    """Each geom on its own."""
    INSTANCE = "instance"
    """Each robot without its grippers, each gripper, each piece of furniture and each
    object."""
    CLASS = "class"
    """All robots of a kind, all grippers, all objects whose names differ only by a
    number or a capital letter at the end (`cubeA`, `cubeB`: `cube`)."""


class Labels:
    """Numbers of visible geoms, 1, 2, ...; 0 is the background.

    Attributes:
        names: Name of each number, by level.
        numbers: Number of each geom, then 0, shape (ngeom + 1,), by level.
    """

    def __init__(self, model: mujoco.MjModel, robots: Sequence[RobotState]) -> None:
        bodies = _instances(model, robots)
        kinds = {state.prefix.rstrip("_"): state.robot.name for state in robots}
        instances = [bodies[body] for body in model.geom_bodyid.tolist()]
        classes = [_class_of(name, kinds) for name in instances]
        elements = [
            model.geom(i).name or f"{instances[i]}_geom{i}" for i in range(model.ngeom)
        ]
        self.names: dict[SegmentationLevel, dict[int, str]] = {}
        self.numbers: dict[SegmentationLevel, NDArray[np.int32]] = {}
        found = elements, instances, classes
        for level, names in zip(SegmentationLevel, found, strict=True):
            numbers = {name: i for i, name in enumerate(dict.fromkeys(names), 1)}
            self.names[level] = {i: name for name, i in numbers.items()}
            of_geoms = [*(numbers[name] for name in names), 0]
            self.numbers[level] = np.array(of_geoms, dtype=np.int32)


def _instances(model: mujoco.MjModel, robots: Sequence[RobotState]) -> list[str]:
    """Return the instance of each body."""
    found = [
        model.body(int(root)).name or f"body{int(root)}" for root in model.body_rootid
    ]
    for state in robots:
        for i in range(model.nbody):
            if model.body(i).name.startswith(state.prefix):
                found[i] = state.prefix.rstrip("_")
        for hand in hands_of(state):
            for body in hand.gripper_bodies:
                found[body] = f"{state.prefix}{hand.name}_gripper"
    return found


def _class_of(instance: str, kinds: dict[str, str]) -> str:
    if instance in kinds:
        return kinds[instance]
    if instance.endswith("_gripper") and instance.partition("_")[0] in kinds:
        return "gripper"
    return re.sub(r"[_\d]+$|(?<=[a-z])[A-Z]$", "", instance) or instance
