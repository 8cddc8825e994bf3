"""Put robots and things into one MuJoCo specification."""

import logging

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.robot import RobotDescription
from wbc_suite.robot.placing import pose_fields, se3_of
from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene.objects.thing import TORSION, Thing
from wbc_suite.scene.reach import let_floors_ignore_far_links

__all__ = [
    "add_camera",
    "attach_robot",
    "compile_scene",
    "fix_to_frame",
    "place_robot",
    "robot_prefix",
]


log = logging.getLogger(__name__)

SMALL = 24
"""Degrees of freedom up to which islands cost more than they save: a physics step of
Lift takes 6 % less without them at 15 and at 18, as long at 30 and 15 % more at 60."""

GROUNDED = 0.03
"""m; feet and mounts may reach so far into the floor."""


def robot_prefix(index: int) -> str:
    """Return the text before every name of the i-th robot in a scene."""
    return f"robot{index}_"


def place_robot(
    robot: RobotDescription, position: tuple[float, float], yaw: float
) -> RobotDescription:
    """Return the robot moved to x, y on the floor and turned about z.

    Its own root pose is seen from there: a base whose middle lies behind its arm keeps
    it there. The place is part of the description, so that every engine's model of it
    measures from the same world.
    """
    robot = _on_the_floor(robot)
    turn = pin.Quaternion(np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2))
    place = pin.SE3(turn.matrix(), np.array([*position, 0.0]))
    root = pose_fields(place * se3_of(robot.root))
    return robot.with_root(robot.root.kind, **root)


def _on_the_floor(robot: RobotDescription) -> RobotDescription:
    """Lift a robot of which nothing says how high it stands out of the floor.

    The links of many a humanoid's URDF are measured from its pelvis.
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
        "%s: nothing says how high it stands, and it reaches %.2f m below the floor; "
        "it is lifted by so much. [root] pos in its own file says better.",
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

    Fingers keep what they hold from turning about the line between them: they have
    torsional friction, whatever their description says.

    Args:
        spec: The scene.
        robot: The robot.
        prefix: Text before its names.
        frame: What it hangs on; the world by default.
    """
    own = robot.to_mjspec()
    for key in list(own.keys):
        own.delete(key)
    for joint in (j for gripper in robot.synergies for j in robot.groups[gripper]):
        for geom in own.joint(joint).parent.find_all(mujoco.mjtObj.mjOBJ_GEOM):
            geom.condim = max(geom.condim, TORSION)
    spec.attach(own, prefix=prefix, frame=frame or spec.worldbody.add_frame())


def fix_to_frame(spec: mujoco.MjSpec, thing: Thing, frame: str) -> None:
    """Fix a thing to the link of a robot in a scene.

    Args:
        spec: The scene, with the robot.
        thing: The thing; its own pose is seen from the frame.
        frame: Name of a robot's frame, with the robot's prefix.
    """
    site = spec.site(frame)
    at = pin.SE3(pin.Quaternion(*site.quat).normalized().matrix(), site.pos)
    own = pin.SE3(pin.Quaternion(*thing.quat).matrix(), np.array(thing.pos))
    pose = pose_fields(at * own)
    thing.fixed(pose["pos"], pose["quat"]).add_to(spec, site.parent)


def compile_scene(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a scene, and spare MuJoCo work that changes nothing.

    MuJoCo looks for bodies that may touch by spheres around all their geoms, also those
    that are only drawn; without these GR1 has 115 pairs of bodies to look into and not
    191. Geoms that collide keep their spheres, so the same contacts are found. Links
    that cannot reach the floor are not looked at there. In small scenes all constraints
    are solved at once: to find what is independent takes longer. And where no force but
    that of joints' own damping depends on speeds, the explicit integrator, which takes
    that implicitly as well, does what the implicit one does, with less work.
    """
    model = spec.compile()
    model.geom_rbound[(model.geom_contype | model.geom_conaffinity) == 0] = 0.0
    let_floors_ignore_far_links(model)
    if model.nv <= SMALL:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND
    implicit = model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    if implicit and not _speeds_matter(model):
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    return model


def _speeds_matter(model: mujoco.MjModel) -> bool:
    """Whether forces depend on speeds, other than those of joints' linear damping."""
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
    """Add a fixed camera at `eye` that looks at `target`; x of its picture is level.

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
