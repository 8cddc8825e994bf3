"""Simulate a hand, alone, that closes on a cube and is shaken."""

from collections.abc import Collection

import mujoco
import numpy as np

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import (
    Contacts,
    Frame,
    Joint,
    Link,
    Root,
    Synergy,
    rigid_bodies,
)
from wbc_suite.robot.poses import se3_of
from wbc_suite.typing import Vector

CUBE = 0.04  # m, side of the cube
MASS = 0.1  # kg
CLOSING, SHAKING = 0.5, 0.15
"""Time to close, and of each of six pushes, s."""
SHAKE = 15.0  # m/s^2; gravity and 5 m/s^2
YIELDING = (0.1, 0.01)  # error at which a motor has its full effort, rad and m
FAR, SLIP = 0.05, 0.02
"""Greatest way of a held cube from the grasp, and of that the part when shaken, m."""
EFFORT = 1.0  # N m or N, of a joint that has none


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


def holds_cube(hand: RobotDescription, synergy: Synergy, tcp: Frame | None) -> bool:
    """Whether a cube of 4 cm and 100 g at the `tcp` stays there when the hand closes.

    Then the palm is pushed along all axes by 15 m/s^2, which act on the cube as
    gravity does.
    """
    if tcp is None or tcp.link not in {link.name for link in hand.links}:
        return False
    model = _scene(hand, synergy, tcp)
    data = mujoco.MjData(model)
    for joint, value in hand.posture(synergy.open).items():
        if joint not in hand.joint_names:  # of the wrist
            continue
        data.joint(joint).qpos[0] = value
    mujoco.mj_kinematics(model, data)
    cube = model.joint("cube").qposadr[0]
    begin = data.site("grasp").xpos.copy()
    data.qpos[cube : cube + 3] = begin
    mujoco.mju_mat2Quat(data.qpos[cube + 3 : cube + 7], data.site("grasp").xmat)
    data.ctrl[:] = [synergy.closed[model.actuator(k).name] for k in range(model.nu)]
    _run(model, data, CLOSING, np.zeros(3))
    gripped = data.qpos[cube : cube + 3].copy()
    for push in (*np.eye(3), *-np.eye(3)):
        _run(model, data, SHAKING, SHAKE * push)
    moved, slip = (
        float(np.linalg.norm(data.qpos[cube : cube + 3] - x)) for x in (begin, gripped)
    )
    held = moved < FAR and slip < SLIP and data.ncon > 0
    return held and not data.warning.number.any()


def _run(
    model: mujoco.MjModel, data: mujoco.MjData, seconds: float, gravity: Vector
) -> None:
    model.opt.gravity[:] = gravity
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)


def _scene(hand: RobotDescription, synergy: Synergy, tcp: Frame) -> mujoco.MjModel:
    spec = hand.to_mjspec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for name in synergy.open:
        if name in hand.joint_names:
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


def _add_servo(spec: mujoco.MjSpec, joint: Joint) -> None:
    effort = joint.effort or EFFORT
    stiffness = effort / YIELDING[joint.type == "slide"]
    rotor = max(joint.armature, 1e-4 * effort)
    actuator = spec.add_actuator(name=joint.name, target=joint.name)
    actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
    actuator.set_to_position(kp=stiffness, kv=2.0 * float(np.sqrt(stiffness * rotor)))
    actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    actuator.forcerange = [-effort, effort]
