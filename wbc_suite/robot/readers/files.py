"""Names of exported files, and gains that they carry."""

import re
from pathlib import Path

import numpy as np
import pinocchio as pin

from wbc_suite.atomic_files import write_bytes
from wbc_suite.robot.description import RobotDescription

STIFFNESS = 150.0
"""1/s^2: stiffness over inertia of joints whose motor states no gains, critically
damped; as in `OSC_POSE` here and in robosuite."""


def file_stem(robot: RobotDescription) -> str:
    """Return the robot's name as ROS names packages: words of a-z and 0-9 with `_`."""
    boundary = r"(?<=[a-z])(?=[A-Z])|(?<=[0-9])(?=[A-Z][a-z])"
    words = re.sub(boundary, "_", robot.name).lower()
    stem = re.sub(r"[^a-z0-9]+", "_", words).strip("_")
    return stem if stem[:1].isalpha() else f"robot_{stem}".rstrip("_")


def write_text(path: Path, text: str) -> None:
    """Write a file, and make the folders that it lies in."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(path, text.encode())


def joint_gains(robot: RobotDescription) -> dict[str, tuple[float, float]]:
    """Return the gains (kp, kd) of motors, in N m/rad and N m s/rad or N/m and N s/m.

    A joint whose actuator states none has `STIFFNESS` times the inertia that its motor
    moves in the posture `ready`, with all other joints at rest.
    """
    stated = {a.joint: (a.kp, a.kd) for a in robot.actuators if a.kind != "motor"}
    model = robot.to_pinocchio()
    q, names = pin.neutral(model), list(robot.keyframes)
    if names:
        first = "ready" if "ready" in names else names[0]
        q = model.referenceConfigurations[first]
    M = pin.crba(model, model.createData(), q)
    gains: dict[str, tuple[float, float]] = {}
    for joint in robot.joints:
        if joint.independent and joint.effort:
            v = model.joints[model.getJointId(joint.name)].idx_v
            kp = STIFFNESS * float(M[v, v])
            own = kp, 2.0 * kp / float(np.sqrt(STIFFNESS))
            gains[joint.name] = stated.get(joint.name, own)
    return gains
