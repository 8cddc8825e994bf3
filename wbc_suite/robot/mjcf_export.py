"""Build the MuJoCo model of a robot from its description."""

from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Actuator, Joint, rigid_bodies
from wbc_suite.robot.inertia import inertia_fields
from wbc_suite.robot.mesh_files import write_stl
from wbc_suite.robot.mjcf_export_geoms import VisualGeoms, add_collision_geoms
from wbc_suite.robot.moving_inertias import moving_inertias
from wbc_suite.robot.shape_geometry import convex_hull

STOP_SOLREF = (0.004, 1.0)
"""Time constant in s and damping ratio of joint limits, the stiffest that is stable
with a step of 2 ms. With MuJoCo's default of 20 ms a joint overshoots its limit by
3.7 mrad at 0.5 rad/s, and a head of 4 kg by 20 mrad; limits of real joints are hard."""
STOP_SOLIMP = (0.95, 0.99, 0.001)
"""Smallest and largest impedance of joint limits, and the width between, m or rad."""
STOP_MARGIN = 8e-3
"""Greatest distance in rad at which limits of limbs' joints become active: MuJoCo tests
them only at the start of a step, in which contacts accelerate wrists to 5 rad/s.
Controllers keep limbs this far inside."""
FINGER_MARGIN = 5e-3
"""The same for fingers of hands, which grasp thin bars near the ends of their range."""
LONGEST_STEP = 2e-3
"""s, of physics; the way at its speed limit in it is the margin of a slow joint."""
ROUNDING = 1e-12
"""Relative reserve of the triangle inequality, which MuJoCo checks without any."""
SITE_GROUP = 4  # site group of frames, hidden by default

STIFF = (0.005, 1.0)
"""Time constant in s and damping ratio of couplings, stable with a step of 2 ms."""

SENSOR_TYPES = {
    "force": mujoco.mjtSensor.mjSENS_FORCE,
    "torque": mujoco.mjtSensor.mjSENS_TORQUE,
    "gyro": mujoco.mjtSensor.mjSENS_GYRO,
    "accelerometer": mujoco.mjtSensor.mjSENS_ACCELEROMETER,
    "touch": mujoco.mjtSensor.mjSENS_TOUCH,
}
"""MuJoCo's sensor types by the kinds of the description."""


def build_mjspec(robot: RobotDescription, *, merged: bool = True) -> mujoco.MjSpec:
    """Build the MuJoCo specification of a robot.

    Links become bodies, frames become sites, and each joint with an effort gets a
    torque motor of its own name unless the description gives another. `merged` visual
    shapes of a link become one mesh, which is faster to simulate and to draw.
    """
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.compiler.degree = False
    spec.compiler.savecompiled = False
    bodies = {"world": spec.worldbody}
    inertias = moving_inertias(robot)
    margins = _margins(robot)
    visual = VisualGeoms(spec, robot, merged=merged)
    for link in robot.links:
        placed = robot.root if link.parent is None else link
        body = bodies[link.parent or "world"].add_body(
            name=link.name, pos=placed.pos, quat=placed.quat
        )
        body.gravcomp = link.gravcomp
        bodies[link.name] = body
        if link.parent is None and robot.root.kind == "free":
            body.add_joint(name="root", type=mujoco.mjtJoint.mjJNT_FREE)
        for joint in robot.root.joints if link.parent is None else ():
            _add_joint(body, joint, margin=0.0)
        if link.joint is not None:
            mimic = link.joint.mimic  # one of ratio 0 rests where it is
            driver = mimic.joint if mimic and mimic.ratio else link.joint.name
            _add_joint(body, link.joint, margin=margins.get(driver, 0.0))
        _set_inertia(body, inertias[link.name])
        visual.add(body, link)
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
    _add_tendons(spec, robot)
    _add_keyframes(spec, robot)
    return spec


def write_mjcf(robot: RobotDescription, *, mesh_dir: Path | None = None) -> str:
    """Return MJCF text with all digits, with one geom per visual shape.

    Meshes are in the text, or in STL files in `mesh_dir`, which the text names relative
    to the folder's parent.
    """
    spec = build_mjspec(robot, merged=False)
    spec.compile()
    if mesh_dir is None:
        return spec.to_xml()
    tree = ElementTree.fromstring(spec.to_xml())
    for mesh in tree.iterfind("asset/mesh"):
        vertices = np.array(mesh.attrib.pop("vertex").split(), np.float64)
        faces = np.array(mesh.attrib.pop("face", "").split(), np.int64)
        vertices = vertices.reshape(-1, 3)
        triangles = vertices, faces.reshape(-1, 3)
        if not len(faces):
            triangles = convex_hull(vertices)
        file = f"{mesh_dir.name}/{mesh.get('name')}.stl"
        write_stl(mesh_dir.parent / file, *triangles)
        mesh.set("file", file)
    return ElementTree.tostring(tree, "unicode") + "\n"


def _margins(robot: RobotDescription) -> dict[str, float]:
    """Return the margins of limits by joint; jaws, of one synergy, have none."""
    most: dict[str, float] = {}
    for synergies in robot.synergies.values():
        if len(synergies) > 1:
            joints = [joint for synergy in synergies for joint in synergy.open]
            most |= dict.fromkeys(joints, FINGER_MARGIN)
    for limb in robot.groups.keys() - robot.synergies.keys():
        most |= dict.fromkeys(robot.groups[limb], STOP_MARGIN)
    speeds = {joint.name: joint.velocity or np.inf for joint in robot.joints}
    return {joint: min(m, LONGEST_STEP * speeds[joint]) for joint, m in most.items()}


def _add_joint(body: mujoco.MjsBody, joint: Joint, *, margin: float) -> None:
    """Add a joint; a hinge has a margin before its limits."""
    kinds = mujoco.mjtJoint
    added = body.add_joint(
        name=joint.name,
        type=kinds.mjJNT_HINGE if joint.type == "hinge" else kinds.mjJNT_SLIDE,
        axis=joint.axis,
        armature=joint.armature,
        frictionloss=joint.frictionloss,
    )
    added.damping[0] = joint.damping
    added.stiffness[0], added.springref = joint.stiffness, joint.springref
    added.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    if joint.range is not None:
        added.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        added.solref_limit = STOP_SOLREF
        added.solimp_limit[:3] = STOP_SOLIMP
        added.range = joint.range
        if joint.type == "hinge":
            added.margin = margin


def _set_inertia(body: mujoco.MjsBody, inertia: pin.Inertia) -> None:
    if inertia.mass == 0.0:
        return
    body.explicitinertial = True
    body.mass = inertia.mass
    body.ipos = inertia.lever
    if inertia.inertia.any():
        moments = np.linalg.eigvalsh(inertia.inertia)
        excess = moments[2] * (1.0 + ROUNDING) - moments[0] - moments[1]
        tensor = inertia.inertia + max(0.0, excess) * np.eye(3)
        body.fullinertia = inertia_fields(tensor)
    else:  # a point mass, which MuJoCo refuses as a full tensor
        body.inertia = np.zeros(3)


def _add_actuators(spec: mujoco.MjSpec, robot: RobotDescription) -> None:
    root = robot.root.joints if robot.root.actuated else ()
    given = {actuator.joint: actuator for actuator in robot.actuators}
    for joint in (*root, *robot.joints):
        actuator = given.get(joint.name)
        if actuator is None and joint.effort and joint.independent:
            actuator = Actuator(joint=joint.name, kind="motor")
        if actuator is not None:
            _add_actuator(spec, joint, actuator)


def _add_actuator(spec: mujoco.MjSpec, joint: Joint, actuator: Actuator) -> None:
    added = spec.add_actuator(
        name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT
    )
    limits: tuple[float, float] | None = None
    if actuator.kind == "position":
        added.set_to_position(kp=actuator.kp, kv=actuator.kd)
        limits = joint.range
    elif actuator.kind == "velocity":
        added.set_to_velocity(kv=actuator.kd)
        limits = (-joint.velocity, joint.velocity) if joint.velocity else None
    else:
        added.set_to_motor()
    effort = actuator.effort or joint.effort
    if effort is not None:
        added.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
        added.forcerange = (-effort, effort)
        limits = (-effort, effort) if actuator.kind == "motor" else limits
    if limits is not None:
        added.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        added.ctrlrange = limits


def _add_sensors(spec: mujoco.MjSpec, robot: RobotDescription) -> None:
    for sensor in robot.sensors:
        spec.add_sensor(
            name=sensor.name,
            type=SENSOR_TYPES[sensor.kind],
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
        welded = connect.quat is not None
        equality = spec.add_equality(
            type=mujoco.mjtEq.mjEQ_WELD if welded else mujoco.mjtEq.mjEQ_CONNECT,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            name=f"connect{index}_{connect.link}_{connect.other}",
            name1=connect.link,
            name2=connect.other,
        )
        equality.data[:3] = (0.0, 0.0, 0.0) if welded else connect.anchor
        if connect.quat is not None:
            equality.data[3:11] = (*connect.anchor, *connect.quat, 1.0)
        equality.solref[:2] = STIFF
    pairs = {*robot.contacts.exclude, *_welded_neighbours(robot)}
    for first, second in sorted(pairs):
        spec.add_exclude(name=f"{first}_{second}", bodyname1=first, bodyname2=second)


def _add_tendons(spec: mujoco.MjSpec, robot: RobotDescription) -> None:
    for tendon in robot.tendons:
        added = spec.add_tendon(name=tendon.name, frictionloss=tendon.frictionloss)
        added.stiffness[0], added.damping[0] = tendon.stiffness, tendon.damping
        if tendon.springlength is not None:
            added.springlength = tendon.springlength
        if tendon.range is not None:
            added.limited, added.range = mujoco.mjtLimited.mjLIMITED_TRUE, tendon.range
        for step in tendon.path:
            if step.joint is not None:
                added.wrap_joint(step.joint, step.coef)
            else:
                added.wrap_site(step.frame)
        if tendon.held is not None:
            equality = spec.add_equality(
                type=mujoco.mjtEq.mjEQ_TENDON,
                objtype=mujoco.mjtObj.mjOBJ_TENDON,
                name=f"{tendon.name}_held",
                name1=tendon.name,
            )
            equality.data[:5] = (tendon.held, 0, 0, 0, 0)


def _welded_neighbours(robot: RobotDescription) -> Iterable[tuple[str, str]]:
    """Yield pairs of a static link of a fixed robot and a link that moves on it.

    MuJoCo itself excludes bodies and parents, except parents welded to the world.
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
    start = [0.0] * len(robot.root.joints)
    if robot.root.kind == "free":
        start = [*robot.root.pos, *robot.root.quat]
    for name in robot.keyframes:
        values = robot.keyframe(name)
        joints = [values[joint] for joint in robot.joint_names]
        spec.add_key(name=name, qpos=np.array([*start, *joints]))
