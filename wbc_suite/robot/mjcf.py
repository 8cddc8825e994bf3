"""Build MuJoCo's model of a robot directly from its description."""

from collections.abc import Iterable

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.mjcf_drawn import DrawnLinks
from wbc_suite.robot.mjcf_geoms import add_collision_geoms
from wbc_suite.robot.parts import Actuator, Joint, Link
from wbc_suite.robot.validation import inertia_matrix, rigid_bodies

__all__ = ["build_mjspec", "write_mjcf"]

STOP_SOLREF = (0.004, 1.0)
"""Time constant in s and damping ratio of joints' stops, which are hard on a machine:
with MuJoCo's own 20 ms a joint that arrives at 0.5 rad/s passes by 3.7 mrad, and a head
of 4 kg swings 20 mrad into its stop. It is the stiffest that a step of 2 ms carries."""
STOP_SOLIMP = (0.95, 0.99, 0.001)
"""How firmly a stop holds: least, most, and the depth, m or rad, between the two."""
STOP_MARGIN = 3e-3
"""rad; so far before its end a limb's stop begins to act: MuJoCo sees a stop only where
a step of 2 ms begins, and a contact throws a joint at up to 2.6 rad/s. Controllers keep
limbs at least as far inside; fingers, which rest at their stops, have none."""
SITE_GROUP = 4
"""Site group of frames: hidden unless asked for."""

STIFF = (0.005, 1.0)
"""Time constant in s and damping ratio of couplings: as stiff as 2 ms steps allow."""


def build_mjspec(robot: RobotDescription, *, merged: bool = True) -> mujoco.MjSpec:
    """Build the MuJoCo specification of a robot.

    Links become bodies, frames become sites, and each joint with an effort gets a
    torque motor of its own name unless the description gives another.

    Args:
        robot: The robot.
        merged: Whether the drawn shapes of a link become one mesh, which is faster to
            simulate and to draw.
    """
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.compiler.degree = False
    spec.compiler.savecompiled = False
    bodies = {"world": spec.worldbody}
    inertias = _inertias(robot)
    limbs = robot.groups.keys() - robot.synergies.keys()
    clear = {joint for name in limbs for joint in robot.groups[name]}
    drawn = DrawnLinks(spec, robot, merged=merged)
    for link in robot.links:
        parent = bodies[link.parent or "world"]
        bodies[link.name] = body = _add_body(parent, robot, link)
        if link.joint is not None:
            _add_joint(body, link.joint, clear=link.joint.name in clear)
        _set_inertia(body, inertias[link.name])
        drawn.add(body, link)
        add_collision_geoms(spec, body, robot, link)
    for frame in robot.frames:
        bodies[frame.link].add_site(
            name=frame.name, pos=frame.pos, quat=frame.quat, group=SITE_GROUP
        )
    for camera in robot.cameras:
        bodies[camera.link].add_camera(
            name=camera.name,
            pos=camera.pos,
            quat=camera.quat,
            fovy=camera.fovy,
            resolution=camera.resolution,
        )
    _add_actuators(spec, robot)
    _add_sensors(spec, robot)
    _add_constraints(spec, robot)
    _add_keyframes(spec, robot)
    return spec


def write_mjcf(robot: RobotDescription) -> str:
    """Write the specification as MJCF text with all digits, every shape by itself."""
    spec = build_mjspec(robot, merged=False)
    spec.compile()
    return spec.to_xml()


def _add_body(parent: mujoco.MjsBody, robot: RobotDescription, link: Link):  # noqa: ANN202 - MuJoCo's own type
    if link.parent is None:
        body = parent.add_body(name=link.name, pos=robot.root.pos, quat=robot.root.quat)
        _add_root_joints(body, robot)
    else:
        body = parent.add_body(name=link.name, pos=link.pos, quat=link.quat)
    return body


def _add_root_joints(body: mujoco.MjsBody, robot: RobotDescription) -> None:
    if robot.root.kind == "free":
        body.add_joint(name="root", type=mujoco.mjtJoint.mjJNT_FREE)
    if robot.root.kind == "planar":
        slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
        kinds = ((slide, (1, 0, 0)), (slide, (0, 1, 0)), (hinge, (0, 0, 1)))
        linear, angular = robot.root.damping
        for name, (kind, axis), damping in zip(
            robot.root_joint_names, kinds, (linear, linear, angular), strict=True
        ):
            joint = body.add_joint(name=name, type=kind, axis=axis)
            joint.damping[0] = damping


def _add_joint(body: mujoco.MjsBody, joint: Joint, *, clear: bool) -> None:
    """Add a joint, one that is kept clear of its stops or one that rests at them."""
    kinds = {
        "hinge": mujoco.mjtJoint.mjJNT_HINGE,
        "slide": mujoco.mjtJoint.mjJNT_SLIDE,
    }
    added = body.add_joint(
        name=joint.name,
        type=kinds[joint.type],
        axis=joint.axis,
        armature=joint.armature,
        frictionloss=joint.frictionloss,
    )
    added.damping[0] = joint.damping
    added.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    if joint.range is not None:
        added.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        added.solref_limit = STOP_SOLREF
        added.solimp_limit[:3] = STOP_SOLIMP
        added.range = joint.range
        if joint.type == "hinge" and clear:
            added.margin = STOP_MARGIN


def _inertias(robot: RobotDescription) -> dict[str, pin.Inertia]:
    """Collect link inertias in link axes.

    MuJoCo wants mass on the very body that moves, so a moving link without mass takes
    over the inertia of what is fixed to it; the dynamics stay the same.
    """
    inertias = {
        link.name: pin.Inertia(
            link.mass, np.asarray(link.com), inertia_matrix(link.inertia)
        )
        for link in robot.links
    }
    rigid = rigid_bodies(robot.links)
    placement: dict[str, pin.SE3] = {}
    for link in robot.links:
        owner = rigid[link.name]
        if owner == link.name:
            placement[link.name] = pin.SE3.Identity()
            continue
        quat = pin.Quaternion(*link.quat)
        local = pin.SE3(quat.matrix(), np.asarray(link.pos))
        placement[link.name] = placement[str(link.parent)] * local
        moves = owner != robot.links[0].name or robot.root.kind != "fixed"
        if moves and robot.link(owner).mass == 0.0 and link.mass > 0.0:
            inertias[owner] += placement[link.name].act(inertias[link.name])
            inertias[link.name] = pin.Inertia.Zero()
    return inertias


def _set_inertia(body: mujoco.MjsBody, inertia: pin.Inertia) -> None:
    if inertia.mass == 0.0:
        return
    about = inertia.inertia
    body.explicitinertial = True
    body.mass = inertia.mass
    body.ipos = inertia.lever
    if not about.any():  # a point mass; MuJoCo refuses it as a full tensor
        body.inertia = np.zeros(3)
        return
    body.fullinertia = [
        about[0, 0], about[1, 1], about[2, 2], about[0, 1], about[0, 2], about[1, 2]
    ]  # fmt: skip


def _add_actuators(spec: mujoco.MjSpec, robot: RobotDescription) -> None:
    if robot.root.kind == "planar" and robot.root.actuated:
        force, torque = robot.root.effort
        for name, effort in zip(
            robot.root_joint_names, (force, force, torque), strict=True
        ):
            _add_motor(spec, name, effort)
    given = {actuator.joint: actuator for actuator in robot.actuators}
    for joint in robot.joints:
        actuator = given.get(joint.name)
        if actuator is not None:
            _add_actuator(spec, joint, actuator)
        elif joint.effort and not joint.passive and joint.mimic is None:
            _add_motor(spec, joint.name, joint.effort)


def _add_motor(spec: mujoco.MjSpec, joint: str, effort: float) -> None:
    motor = spec.add_actuator(
        name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT
    )
    motor.set_to_motor()
    motor.ctrllimited = motor.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    motor.ctrlrange = motor.forcerange = (-effort, effort)


def _add_actuator(spec: mujoco.MjSpec, joint: Joint, actuator: Actuator) -> None:
    added = spec.add_actuator(
        name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT
    )
    limits = (-1e10, 1e10)
    if actuator.kind == "position":
        added.set_to_position(kp=actuator.kp, kv=actuator.kd)
        limits = joint.range or limits
    elif actuator.kind == "velocity":
        added.set_to_velocity(kv=actuator.kd)
        limits = (-joint.velocity, joint.velocity) if joint.velocity else limits
    else:
        added.set_to_motor()
    effort = actuator.effort or joint.effort
    if effort is not None:
        added.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
        added.forcerange = (-effort, effort)
        limits = (-effort, effort) if actuator.kind == "motor" else limits
    if abs(limits[1]) < 1e10:
        added.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        added.ctrlrange = limits


def _add_sensors(spec: mujoco.MjSpec, robot: RobotDescription) -> None:
    kinds = {
        "force": mujoco.mjtSensor.mjSENS_FORCE,
        "torque": mujoco.mjtSensor.mjSENS_TORQUE,
        "gyro": mujoco.mjtSensor.mjSENS_GYRO,
        "accelerometer": mujoco.mjtSensor.mjSENS_ACCELEROMETER,
        "touch": mujoco.mjtSensor.mjSENS_TOUCH,
    }
    for sensor in robot.sensors:
        spec.add_sensor(
            name=sensor.name,
            type=kinds[sensor.kind],
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=sensor.frame,
            noise=sensor.noise,
        )


def _add_constraints(spec: mujoco.MjSpec, robot: RobotDescription) -> None:
    for joint in robot.joints:
        if joint.mimic is None or joint.mimic.closed:
            continue
        equality = spec.add_equality(
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name=f"{joint.name}_mimic",
            name1=joint.name,
            name2=joint.mimic.joint,
        )
        equality.data[:5] = (joint.mimic.offset, joint.mimic.ratio, 0, 0, 0)
        equality.solref[:2] = STIFF
    for index, connect in enumerate(robot.connects):
        equality = spec.add_equality(
            type=mujoco.mjtEq.mjEQ_CONNECT,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            name=f"connect{index}_{connect.link}_{connect.other}",
            name1=connect.link,
            name2=connect.other,
        )
        equality.data[:3] = connect.anchor
        equality.solref[:2] = STIFF
    pairs = {*robot.contacts.exclude, *_welded_neighbours(robot)}
    for first, second in sorted(pairs):
        spec.add_exclude(name=f"{first}_{second}", bodyname1=first, bodyname2=second)


def _welded_neighbours(robot: RobotDescription) -> Iterable[tuple[str, str]]:
    """Pair the static links of a fixed robot with the links that move on them.

    MuJoCo lets neighbours over a joint pass through each other, but not where one of
    them is welded to the world.
    """
    if robot.root.kind != "fixed":
        return
    rigid = rigid_bodies(robot.links)
    static = robot.links[0].name
    moving = {a.name for a in robot.links if rigid.get(a.parent or "") == static}
    shaped = [link.name for link in robot.links if link.collision]
    given = {frozenset(pair) for pair in robot.contacts.exclude}
    for first in (name for name in shaped if rigid[name] == static):
        for second in (n for n in shaped if rigid[n] != static and rigid[n] in moving):
            if frozenset((first, second)) not in given:
                yield first, second


def _add_keyframes(spec: mujoco.MjSpec, robot: RobotDescription) -> None:
    for name in robot.keyframes:
        values = robot.keyframe(name)
        spec.add_key(
            name=name,
            qpos=np.array([*_root_qpos(robot), *_ordered(robot, values)]),
        )


def _root_qpos(robot: RobotDescription) -> Iterable[float]:
    """Root coordinates of the robot's own pose, in MuJoCo's order."""
    if robot.root.kind == "free":
        return (*robot.root.pos, *robot.root.quat)
    return (0.0,) * len(robot.root_joint_names)


def _ordered(robot: RobotDescription, values: dict[str, float]) -> Iterable[float]:
    return (values[name] for name in robot.joint_names)
