"""A camera behind each robot that looks over its shoulder at its work."""

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription

__all__ = ["add_robot_view", "aim_robot_view"]

NAME = "robotview"
BEHIND, ABOVE, AHEAD = 0.4, 0.5, 0.2
"""m: how far the camera stands behind and above the robot at rest, and how far before
its foremost point it looks."""


def add_robot_view(spec: mujoco.MjSpec, robot: RobotDescription, prefix: str) -> None:
    """Add the camera to the robot's first link; it is aimed once that is compiled."""
    body = spec.body(prefix + robot.links[0].name)
    body.add_camera(name=prefix + NAME, fovy=60.0)


def aim_robot_view(state: RobotState) -> None:
    """Set the camera where it sees the robot, as that stands now, and what is ahead."""
    model, data = state.model, state.data
    low, high = _extent(state)
    eye = np.array([low[0] - BEHIND, 0.0, high[2] + ABOVE])
    target = np.array([high[0] + AHEAD, 0.0, low[2] + 0.6 * (high[2] - low[2])])
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.array([0.0, -1.0, 0.0])
    turn = np.column_stack([right, np.cross(back, right), back])
    root = state.root_pose
    upright = _yaw_only(root)
    pose = root.inverse() * upright * pin.SE3(turn, eye)
    camera = model.camera(state.prefix + NAME).id
    x, y, z, w = pin.Quaternion(pose.rotation).coeffs()
    model.cam_pos[camera] = pose.translation
    model.cam_quat[camera] = w, x, y, z
    mujoco.mj_camlight(model, data)


def _extent(state: RobotState) -> tuple[np.ndarray, np.ndarray]:
    """Return two corners of a box around the robot, seen from where it stands, m."""
    model, data = state.model, state.data
    solid = (model.geom_contype | model.geom_conaffinity) > 0
    own = [
        i
        for i, body in enumerate(model.geom_bodyid.tolist())
        if model.body(body).name.startswith(state.prefix)
    ]
    own = [i for i in own if solid[i]] or own
    place = _yaw_only(state.root_pose)
    if not own:
        bodies = [state.model.body(state.prefix + x.name).id for x in state.robot.links]
        points = (data.xpos[bodies] - place.translation) @ place.rotation
        return points.min(axis=0), points.max(axis=0)
    turns = place.rotation.T @ data.geom_xmat[own].reshape(-1, 3, 3)
    middle, half = np.split(model.geom_aabb[own], 2, axis=1)
    middles = (data.geom_xpos[own] - place.translation) @ place.rotation
    middles += np.einsum("gij,gj->gi", turns, middle)
    reach = np.einsum("gij,gj->gi", abs(turns), half)
    return (middles - reach).min(axis=0), (middles + reach).max(axis=0)


def _yaw_only(pose: pin.SE3) -> pin.SE3:
    """Return the pose turned upright: its x axis laid level."""
    yaw = np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0])
    turn = pin.Quaternion(np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2))
    return pin.SE3(turn.matrix(), pose.translation)
