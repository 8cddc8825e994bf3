"""Read a URDF or MJCF file of a hand as a component that any arm can carry."""

from itertools import permutations, product
from pathlib import Path

import numpy as np
import pinocchio as pin

from wbc_suite.errors import DescriptionError
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.poses import pose_fields
from wbc_suite.robot.robot_file import Component
from wbc_suite.robot.shape_geometry import bounds_of
from wbc_suite.robot.toml_export import as_component
from wbc_suite.typing import Matrix

FORWARD = 0.7  # least cosine of z and the way to the grasp, of a hand for flanges


def read_hand(path: Path) -> Component:
    """Return the hand of a file, placed so that its grasp lies ahead of a flange.

    A hand whose z axis points to its grasp keeps the pose of its file on the flange.
    Another one is turned about its axes by quarters of a turn, and its palm begins at
    the flange. Of its frames it keeps the grasps.

    Raises:
        DescriptionError: If the file has more than a hand.
    """
    if path.suffix.lower() == ".urdf":
        from wbc_suite.robot.urdf_import import read_urdf as read
    else:
        from wbc_suite.robot.mjcf_import import read_mjcf as read
    robot = read(path)
    if [*robot.groups] != ["gripper"] or not robot.synergies:
        raise DescriptionError(
            f"{path}: a gripper is a file with only a hand; found the groups "
            f"{', '.join(robot.groups) or 'none'}. Adopt the file, and correct it."
        )
    grasps = tuple(frame for frame in robot.frames if frame.role == "tcp")
    placed = _on_flange(robot).model_copy(update={"frames": grasps})
    return as_component(placed, "gripper")


def _on_flange(robot: RobotDescription) -> RobotDescription:
    model = robot.to_pinocchio()
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    (hand, *_), first = robot.hands.values(), robot.links[0]
    base = data.oMf[model.getFrameId(first.name)]
    z = base.actInv(data.oMf[model.getFrameId(hand)].translation)
    if z[2] > FORWARD * np.linalg.norm(z):
        return robot
    R = max(_quarter_turns(), key=lambda R: (round(float((R @ z)[2]), 3), R.trace()))
    shapes = first.collision or first.visual
    low, high = bounds_of(shapes) if shapes else (np.zeros(3), np.zeros(3))
    back = min(float((R @ corner)[2]) for corner in _corners(low, high))
    pose = pin.SE3(R, np.array([0.0, 0.0, -back]))
    turned = first.model_copy(update=pose_fields(pose))
    return robot.model_copy(update={"links": (turned, *robot.links[1:])})


def _corners(low: Matrix, high: Matrix) -> list[Matrix]:
    return [np.array(corner) for corner in product(*zip(low, high, strict=True))]


def _quarter_turns() -> list[Matrix]:
    """Return the 24 rotations that map axes to axes."""
    found: list[Matrix] = []
    for order, signs in product(permutations(range(3)), product((1, -1), repeat=3)):
        R = np.eye(3)[list(order)] * np.array(signs)[:, None]
        if np.linalg.det(R) > 0.0:
            found.append(R)
    return found
