"""Robots, their cameras and objects put into one MuJoCo specification."""

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite import logs
from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.poses import pose_at, pose_fields, se3_of
from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene.geom_bounds import box_corners, solid_geoms, support
from wbc_suite.scene.objects.scene_object import TORSION, SceneObject
from wbc_suite.typing import Vector

log = logs.logger(__name__)

SMALL = 24
"""Degrees of freedom up to which constraint islands cost more than they save: without
them a step of Lift takes 6 % less at 15 and 18, as long at 30 and 15 % more at 60."""

GROUNDED = 0.03  # depth by which feet and mounts may reach into the floor, m
CLEARANCE = 2e-3  # m, of the wheels of a base that a planar root moves
LANDED = 0.005  # distance of free feet from the floor that is left as it is, m

ROBOT_VIEW = "robotview"
"""Name of the camera behind each robot, after the robot's prefix."""
CAMERA_BEHIND, CAMERA_ABOVE, LOOKED_AHEAD = 0.4, 0.5, 0.2
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

    The URDF of many a humanoid has its origin in the pelvis. A free robot on feet is
    also put down, since the legs of one in the air kick, and one on wheels. The wheels
    of a planar root do not touch the floor, on which they would drag.
    """
    feet = any(frame.role == "foot" for frame in robot.frames)
    glides = robot.root.kind == "planar" and bool(robot.wheels)
    stands = robot.root.kind == "free" and (feet or bool(robot.wheels))
    if any(robot.root.pos) and not (stands or glides):
        return robot
    height = _lowest_point(robot) - (CLEARANCE if glides else 0.0)
    least = -GROUNDED if not (stands or glides) else 0.0 if glides else -LANDED
    most = LANDED if stands or glides else np.inf
    if least < height < most:
        return robot
    level = log.info if robot.wheels else log.warning
    level(
        "%s has its lowest point %.3f m %s the floor, and is moved onto it. Set "
        "[root] pos in its file.",
        *(robot.name, abs(height), "below" if height < 0.0 else "above"),
    )
    x, y, z = robot.root.pos
    return robot.with_root(robot.root.kind, pos=(x, y, z - height))


def _lowest_point(robot: RobotDescription) -> float:
    """Return the height of the lowest point of a robot's solid shapes at `ready`, m."""
    m = robot.to_mjspec().compile()
    data = mujoco.MjData(m)
    if "ready" in robot.keyframes:
        mujoco.mj_resetDataKeyframe(m, data, m.key("ready").id)
    mujoco.mj_kinematics(m, data)
    bottoms = []
    for geom in solid_geoms(m).tolist():
        down = -data.geom_xmat[geom].reshape(3, 3)[2]  # the vertical in its axes
        depth = support(m, geom, down[None])[0]
        bottoms.append(float(data.geom_xpos[geom, 2] - depth))
    return min(bottoms, default=0.0)


def attach_robot(
    spec: mujoco.MjSpec,
    robot: RobotDescription,
    prefix: str,
    *,
    frame: mujoco.MjsFrame | None = None,
) -> None:
    """Add a robot at its own root pose, on a frame or the world, with prefixed names.

    Fingers get torsional friction, so that an object does not turn about the line
    between them. A camera with the name of `add_robot_view`'s is left out.
    """
    own = robot.to_mjspec()
    for camera in [camera for camera in own.cameras if camera.name == ROBOT_VIEW]:
        own.delete(camera)
    for key in list(own.keys):
        own.delete(key)
    for joint in (j for gripper in robot.synergies for j in robot.groups[gripper]):
        for geom in own.joint(joint).parent.find_all(mujoco.mjtObj.mjOBJ_GEOM):
            geom.condim = max(geom.condim, TORSION)
    spec.attach(own, prefix=prefix, frame=frame or spec.worldbody.add_frame())


def fix_to_frame(spec: mujoco.MjSpec, attached: SceneObject, frame: str) -> None:
    """Fix an object, whose pose is relative to it, to a robot's frame in a scene."""
    site = spec.site(frame)
    at = pin.SE3(pin.Quaternion(*site.quat).normalized().matrix(), site.pos)
    pose = pose_fields(at * pose_at(attached.pos, attached.quat))
    attached.fixed(pose["pos"], pose["quat"]).add_to(spec, site.parent)


def compile_scene(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a scene with settings that save work and keep the results.

    - MuJoCo's broadphase uses bounding spheres of all geoms, visual ones included.
      Those get radius 0: GR1 has 115 pairs of bodies to test instead of 191.
    - In small scenes all constraints are solved at once, without islands.
    """
    model = spec.compile()
    model.geom_rbound[(model.geom_contype | model.geom_conaffinity) == 0] = 0.0
    if model.nv <= SMALL:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND
    return model


def add_camera(
    spec: mujoco.MjSpec, name: str, eye: Vector3, target: Vector3, fovy: float = 45.0
) -> None:
    """Add a fixed, level camera at `eye` with `target` in the middle of its picture.

    Points are in m, the vertical field of view is in degrees.
    """
    pose = pose_fields(_looking_at(np.asarray(eye), np.asarray(target)))
    spec.worldbody.add_camera(name=name, pos=eye, quat=pose["quat"], fovy=fovy)


def _looking_at(eye: Vector, target: Vector) -> pin.SE3:
    """Return the pose of a level camera, which looks along -z with y up."""
    back = (eye - target) / np.linalg.norm(eye - target)
    up = np.array([0.0, 0.0, 1.0]) if abs(back[2]) < 0.99 else np.array([1.0, 0.0, 0.0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return pin.SE3(np.column_stack([right, np.cross(back, right), back]), eye)


def add_robot_view(spec: mujoco.MjSpec, robot: RobotDescription, prefix: str) -> None:
    """Add a camera behind the robot to its first link; see `aim_robot_view`."""
    body = spec.body(prefix + robot.links[0].name)
    body.add_camera(name=prefix + ROBOT_VIEW, fovy=60.0)


def aim_robot_view(state: RobotState) -> None:
    """Set the camera behind a robot so that it shows the robot and the space ahead."""
    model, data = state.model, state.data
    base = state.root_pose
    yaw = np.arctan2(base.rotation[1, 0], base.rotation[0, 0])
    upright = pin.SE3(pin.utils.rotate("z", yaw), base.translation)
    low, high = _extent(state, upright)
    eye = np.array([low[0] - CAMERA_BEHIND, 0.0, high[2] + CAMERA_ABOVE])
    target = np.array([high[0] + LOOKED_AHEAD, 0.0, low[2] + 0.6 * (high[2] - low[2])])
    pose = pose_fields(base.inverse() * upright * _looking_at(eye, target))
    camera = model.camera(state.prefix + ROBOT_VIEW).id
    model.cam_pos[camera], model.cam_quat[camera] = pose["pos"], pose["quat"]
    mujoco.mj_camlight(model, data)


def _extent(state: RobotState, place: pin.SE3) -> tuple[Vector, Vector]:
    """Return the corners of a box around the robot in another frame, m."""
    model, data = state.model, state.data
    prefix, bodies = state.prefix, model.geom_bodyid.tolist()
    named = [k for k, b in enumerate(bodies) if model.body(b).name.startswith(prefix)]
    own = np.intersect1d(named, solid_geoms(model)) if named else np.empty(0, int)
    geoms = own if len(own) else np.array(named, int)
    if len(geoms):
        at = place.translation, place.rotation
        low, high = box_corners(model, data, geoms, *at)
    else:
        links = [model.body(prefix + link.name).id for link in state.robot.links]
        low = high = (data.xpos[links] - place.translation) @ place.rotation
    return low.min(axis=0), high.max(axis=0)
