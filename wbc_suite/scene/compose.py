"""Robots, their cameras and objects put into one MuJoCo specification."""

import logging

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.poses import pose_at, pose_fields, se3_of
from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene.objects.scene_object import TORSION, SceneObject

log = logging.getLogger(__name__)

SMALL = 24
"""Degrees of freedom up to which constraint islands cost more than they save: a physics
step of Lift takes 6 % less without them at 15 and at 18, as long at 30 and 15 % more at
60."""

GROUNDED = 0.03
"""Depth by which feet and mounts may reach into the floor, m."""

ROBOT_VIEW = "robotview"
"""Name of the camera behind each robot, after the robot's prefix."""
BEHIND, ABOVE, AHEAD = 0.4, 0.5, 0.2
"""Distance of that camera behind and above the robot at rest, and of its target in
front of the robot, m."""


def robot_prefix(index: int) -> str:
    """Return the text before every name of the i-th robot in a scene."""
    return f"robot{index}_"


def place_robot(
    robot: RobotDescription, position: tuple[float, float], yaw: float
) -> RobotDescription:
    """Return the robot moved to x, y on the floor and turned about z.

    Its own root pose is relative to that place. The place is part of the description,
    so that the models of all engines use the same world frame.
    """
    robot = _on_the_floor(robot)
    place = pin.SE3(pin.utils.rotate("z", yaw), np.array([*position, 0.0]))
    root = pose_fields(place * se3_of(robot.root))
    return robot.with_root(robot.root.kind, **root)


def _on_the_floor(robot: RobotDescription) -> RobotDescription:
    """Raise a robot without a root height so that it stands on the floor.

    The URDF of many a humanoid has its origin in the pelvis.
    """
    if any(robot.root.pos):
        return robot
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    if "ready" in robot.keyframes:
        for name, value in robot.keyframe("ready").items():
            data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    solid = (model.geom_contype | model.geom_conaffinity) > 0
    upward = data.geom_xmat[solid].reshape(-1, 3, 3)[:, 2]  # rows of z
    centre, half = np.split(model.geom_aabb[solid], 2, axis=1)
    bottoms = data.geom_xpos[solid, 2] + np.sum(upward * centre - abs(upward) * half, 1)
    depth = -float(bottoms.min(initial=0.0))
    if depth < GROUNDED:
        return robot
    log.warning(
        "%s has no root height and reaches %.2f m below the floor; it is raised. "
        "Set [root] pos in its file.",
        robot.name,
        depth,
    )
    return robot.with_root(robot.root.kind, pos=(0.0, 0.0, depth))


def attach_robot(
    spec: mujoco.MjSpec,
    robot: RobotDescription,
    prefix: str,
    *,
    frame: mujoco.MjsFrame | None = None,
) -> None:
    """Add a robot at its own root pose; every name of it gets the prefix.

    Fingers get torsional friction, so that an object does not turn about the line
    between them.

    Args:
        spec: The scene.
        robot: The robot.
        prefix: Text before its names.
        frame: Frame that it is attached to; the world by default.
    """
    own = robot.to_mjspec()
    for key in list(own.keys):
        own.delete(key)
    for joint in (j for gripper in robot.synergies for j in robot.groups[gripper]):
        for geom in own.joint(joint).parent.find_all(mujoco.mjtObj.mjOBJ_GEOM):
            geom.condim = max(geom.condim, TORSION)
    spec.attach(own, prefix=prefix, frame=frame or spec.worldbody.add_frame())


def fix_to_frame(spec: mujoco.MjSpec, attached: SceneObject, frame: str) -> None:
    """Fix an object to the link of a robot in a scene.

    Args:
        spec: The scene, with the robot.
        attached: The object; its own pose is relative to the frame.
        frame: Name of a robot's frame, with the robot's prefix.
    """
    site = spec.site(frame)
    at = pin.SE3(pin.Quaternion(*site.quat).normalized().matrix(), site.pos)
    pose = pose_fields(at * pose_at(attached.pos, attached.quat))
    attached.fixed(pose["pos"], pose["quat"]).add_to(spec, site.parent)


def compile_scene(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a scene with settings that save work and keep the results.

    - MuJoCo's broadphase uses bounding spheres of all geoms, visual ones included.
      Those get radius 0: GR1 has 115 pairs of bodies to test instead of 191.
    - In small scenes all constraints are solved at once, without islands.
    - If no force but joint damping depends on velocities, the Euler integrator, which
      takes joint damping implicitly as well, replaces the implicit one.
    """
    model = spec.compile()
    model.geom_rbound[(model.geom_contype | model.geom_conaffinity) == 0] = 0.0
    if model.nv <= SMALL:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND
    implicit = model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    if implicit and not _has_velocity_forces(model):
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    return model


def _has_velocity_forces(model: mujoco.MjModel) -> bool:
    """Whether forces other than linear joint damping depend on velocities."""
    gains, biases = model.actuator_gaintype, model.actuator_biastype
    fixed = gains == mujoco.mjtGain.mjGAIN_FIXED
    affine = biases == mujoco.mjtBias.mjBIAS_AFFINE
    slow = affine & (model.actuator_biasprm[:, 2] == 0.0)
    slow |= biases == mujoco.mjtBias.mjBIAS_NONE
    damped = (model.tendon_damping, model.actuator_damping, model.dof_dampingpoly)
    return (
        not np.all(fixed & slow)
        or any(array.any() for array in damped)
        or max(model.opt.density, model.opt.viscosity) > 0.0
        or model.nflex + model.nplugin > 0
    )


def add_camera(
    spec: mujoco.MjSpec, name: str, eye: Vector3, target: Vector3, fovy: float = 45.0
) -> None:
    """Add a fixed, level camera at `eye` with `target` in the middle of its picture.

    Args:
        spec: The scene.
        name: Name of the camera.
        eye: Position, m.
        target: Point in the middle of the picture, m.
        fovy: Vertical field of view, degrees.
    """
    back = np.asarray(eye, dtype=np.float64) - np.asarray(target)
    back /= np.linalg.norm(back)
    up = np.array([0.0, 0.0, 1.0]) if abs(back[2]) < 0.99 else np.array([1.0, 0.0, 0.0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    x, y, z, w = pin.Quaternion(
        np.column_stack([right, np.cross(back, right), back])
    ).coeffs()
    spec.worldbody.add_camera(name=name, pos=eye, quat=(w, x, y, z), fovy=fovy)


def add_robot_view(spec: mujoco.MjSpec, robot: RobotDescription, prefix: str) -> None:
    """Add a camera behind the robot to its first link; see `aim_robot_view`."""
    body = spec.body(prefix + robot.links[0].name)
    body.add_camera(name=prefix + ROBOT_VIEW, fovy=60.0)


def aim_robot_view(state: RobotState) -> None:
    """Set the camera behind a robot so that it shows the robot and the space ahead."""
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
    camera = model.camera(state.prefix + ROBOT_VIEW).id
    x, y, z, w = pin.Quaternion(pose.rotation).coeffs()
    model.cam_pos[camera] = pose.translation
    model.cam_quat[camera] = w, x, y, z
    mujoco.mj_camlight(model, data)


def _extent(state: RobotState) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of a box around the robot in its level base frame, m."""
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
    """Return the pose without roll and pitch."""
    yaw = np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0])
    return pin.SE3(pin.utils.rotate("z", yaw), pose.translation)
