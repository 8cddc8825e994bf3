"""Simulate a hand, alone, that closes on a cube and is shaken."""

import math
from collections.abc import Collection

import mujoco
import numpy as np

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import (
    Actuator,
    Contacts,
    Frame,
    Joint,
    Link,
    Root,
    Synergy,
    rigid_bodies,
)
from wbc_suite.robot.poses import se3_of

CUBE = 0.04  # m, side of the cube
MASS = 0.1  # kg
CLOSING, SQUEEZING, SHAKING = 0.5, 0.3, 0.15
"""Time to close, until the shaking, and of each of six pushes, s."""
DRAG = (20.0, 0.02)
"""Of the cube until the hand is closed, N s/m and N m s: it does not drift away."""
SHAKE = 15.0  # m/s^2; gravity and 5 m/s^2
YIELDING = (0.1, 0.01)  # error at which a motor has its full effort, rad and m
SLIP = 0.02  # m; greatest way of a held cube when shaken
EFFORT = 1.0  # N m or N, of a joint that has none
MOST_EFFORT = (3.0, 50.0)
"""Greatest effort of a joint, N m and N: a careful grip, on a lever of 6 cm 50 N. Many
files state the peak of a motor."""


def hand_alone(
    robot: RobotDescription, palm: str, moving: Collection[str]
) -> RobotDescription:
    """Return a palm, fixed, with the links that it moves, as a robot.

    Links without collision shapes collide with their visual ones.
    """
    rigid = rigid_bodies(robot.links)
    below = {palm}
    for link in robot.links:
        if link.name in moving and rigid[str(link.parent)] in below:
            below.add(link.name)
    kept = [link for link in robot.links if rigid[link.name] in below]
    names = {link.name for link in kept}
    joints = {x.joint.name for x in kept if x.joint and x.name != palm}

    def own(link: Link) -> Link:
        update: dict[str, object] = {"collision": link.collision or link.visual}
        if link.name == palm:
            still = {"parent": None, "joint": None, "pos": (0.0, 0.0, 0.0)}
            update |= still | {"quat": (1.0, 0.0, 0.0, 0.0)}
        return link.model_copy(update=update)

    pairs = tuple(p for p in robot.contacts.exclude if names.issuperset(p))
    return RobotDescription(
        name="hand",
        materials=robot.materials,
        link=tuple(map(own, kept)),
        connect=tuple(x for x in robot.connects if names.issuperset((x.link, x.other))),
        tendon=tuple(
            x for x in robot.tendons if all(step.joint in joints for step in x.path)
        ),
        contacts=Contacts(exclude=pairs),
        root=Root(kind="fixed"),
    )


def way_of_cube(hand: RobotDescription, synergy: Synergy, tcp: Frame | None) -> float:
    """Return how far a cube of 4 cm and 100 g is moved from the `tcp`, m, inf if lost.

    The hand closes in half a second. Then the palm is pushed along all axes by 15
    m/s^2, which act on the cube as gravity does.
    """
    if tcp is None or tcp.link not in {link.name for link in hand.links}:
        return np.inf
    model = _scene(hand, synergy, tcp)
    data = mujoco.MjData(model)
    for name, value in hand.posture(_own(hand, synergy.open)).items():
        data.joint(name).qpos[0] = value
    mujoco.mj_kinematics(model, data)
    cube = model.joint("cube").qposadr[0]
    begin = data.site("grasp").xpos.copy()
    data.qpos[cube : cube + 3] = begin
    mujoco.mju_mat2Quat(data.qpos[cube + 3 : cube + 7], data.site("grasp").xmat)
    dofs = model.joint("cube").dofadr[0] + np.arange(6)
    model.dof_damping[dofs] = np.repeat(DRAG, 3)
    model.opt.gravity[:] = 0.0
    names = [model.actuator(k).name for k in range(model.nu)]
    ends = np.array([[synergy.open[x], synergy.closed[x]] for x in names])
    steps = round(CLOSING / model.opt.timestep)
    for share in np.linspace(0.0, 1.0, steps):
        data.ctrl[:] = ends @ (1.0 - share, share)
        mujoco.mj_step(model, data)
    mujoco.mj_step(model, data, round(SQUEEZING / model.opt.timestep))
    model.dof_damping[dofs] = 0.0
    gripped = data.qpos[cube : cube + 3].copy()
    for push in (*np.eye(3), *-np.eye(3)):
        model.opt.gravity[:] = SHAKE * push
        mujoco.mj_step(model, data, round(SHAKING / model.opt.timestep))
    moved, slip = (
        float(np.linalg.norm(data.qpos[cube : cube + 3] - x)) for x in (begin, gripped)
    )
    held = slip < SLIP and data.ncon > 0 and not data.warning.number.any()
    return moved if held else np.inf


def _own(hand: RobotDescription, values: dict[str, float]) -> dict[str, float]:
    """Return the values of a hand's joints, without those of its wrist."""
    return {name: x for name, x in values.items() if name in hand.joint_names}


def _scene(hand: RobotDescription, synergy: Synergy, tcp: Frame) -> mujoco.MjModel:
    spec = hand.to_mjspec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for name in _own(hand, synergy.open):
        _add_servo(spec, hand.joint(name))
    for geom in spec.geoms:  # the hand collides with the cube only
        geom.conaffinity, geom.contype = (2, 1) if geom.contype else (0, 0)
    site = spec.body(tcp.link).add_site(name="grasp")
    pose = se3_of(tcp)
    site.pos = pose.translation
    mujoco.mju_mat2Quat(site.quat, pose.rotation.ravel())
    body = spec.worldbody.add_body(name="cube")
    body.add_freejoint(name="cube")
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[CUBE / 2] * 3,
        mass=MASS,
        condim=4,
        contype=2,
        conaffinity=1,
    )
    return spec.compile()


def servo_of(joint: Joint) -> Actuator:
    """Return the servo that drives a joint of a gripper, with estimated gains."""
    effort = min(joint.effort or EFFORT, MOST_EFFORT[joint.type == "slide"])
    kp = effort / YIELDING[joint.type == "slide"]
    rotor = max(joint.armature, 1e-4 * effort)
    kd = 2.0 * math.sqrt(kp * rotor)
    return Actuator(joint=joint.name, kind="position", kp=kp, kd=kd, effort=effort)


def _add_servo(spec: mujoco.MjSpec, joint: Joint) -> None:
    servo, actuator = servo_of(joint), spec.add_actuator(name=joint.name)
    actuator.target, actuator.trntype = joint.name, mujoco.mjtTrn.mjTRN_JOINT
    actuator.set_to_position(kp=servo.kp, kv=servo.kd)
    actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    actuator.forcerange = np.array([-1.0, 1.0]) * (servo.effort or 0.0)
