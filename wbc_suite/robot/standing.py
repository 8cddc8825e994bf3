"""Guess a posture in which legs stand: knees bent, feet below the hips."""

import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.parts import Frame
from wbc_suite.typing import Vector

__all__ = ["standing_legs"]

CLOSE = 0.02
"""m; a foot that stays farther from its place has no such posture."""

ALONG_Y = 0.9
"""Least cosine between the axis of a pitch joint and y."""

BENT = {2: ((0.55, -1.1), 0.85), 3: ((-0.3, 0.6, -0.3), 0.95)}
"""By the number of hinges: angles about y where the search begins, rad, and the part of
the leg's length that is left. A dog's knees point back, a human's forward."""


def standing_legs(robot: RobotDescription) -> dict[str, float]:
    """Return positions for the joints that bend legs, by name, rad.

    Only hinges about y are moved, at most one leg's at a time: the foot comes below the
    uppermost of them, and its sole stays as level as in the posture `ready`. A leg that
    cannot stand so has no entry.

    Args:
        robot: Its `foot` frames tell which chains are legs; its `ready` says where all
            other joints are.
    """
    model = robot.to_pinocchio()
    data = model.createData()
    q = pin.neutral(model)
    for name, value in robot.keyframe("ready").items():
        q[model.joints[model.getJointId(name)].idx_q] = value
    found: dict[str, float] = {}
    for frame in robot.frames:
        if frame.role == "foot":
            found |= _bent_leg(robot, model, data, q, frame)
    return found


def _bent_leg(
    robot: RobotDescription,
    model: pin.Model,
    data: pin.Data,
    q: Vector,
    frame: Frame,
) -> dict[str, float]:
    foot = model.getFrameId(frame.name)
    pin.framesForwardKinematics(model, data, q)
    chain = model.supports[model.frames[foot].parentJoint].tolist()
    along = {joint: _along_y(robot, model, data, joint) for joint in chain}
    hinges = [joint for joint in chain if abs(along[joint]) > ALONG_Y]
    if len(hinges) not in BENT:
        return {}
    angles, left = BENT[len(hinges)]
    places = np.array([model.joints[joint].idx_q for joint in hinges])
    points = np.array(
        [*(data.oMi[j].translation for j in hinges), data.oMf[foot].translation]
    )
    length = float(np.linalg.norm(np.diff(points[:, [0, 2]], axis=0), axis=1).sum())
    level = data.oMf[foot].rotation.copy()
    low, high = model.lowerPositionLimit[places], model.upperPositionLimit[places]

    def misses(angles: Vector) -> Vector:
        """Return how far the foot is from its place, x and z, m, and how tilted."""
        moved = q.copy()
        moved[places] = angles
        pin.framesForwardKinematics(model, data, moved)
        off = data.oMf[foot].translation - data.oMi[hinges[0]].translation
        tilt = pin.log3(level.T @ data.oMf[foot].rotation)[1]
        tilt = tilt if len(hinges) > 2 else 0.0  # a round foot has no sole
        return np.array([off[0], off[2] + left * length, length * tilt])

    signs = np.sign([along[joint] for joint in hinges])
    start: Vector = np.clip(signs * np.asarray(angles), low, high)
    best = least_squares(misses, start, bounds=(low - 1e-9, high + 1e-9))
    if not np.linalg.norm(best.fun) < CLOSE:
        return {}
    names = [model.names[joint] for joint in hinges]
    return dict(zip(names, best.x.clip(low, high).round(4).tolist(), strict=True))


def _along_y(
    robot: RobotDescription, model: pin.Model, data: pin.Data, joint: int
) -> float:
    """Return the cosine between a hinge's axis and y; 0 for what nobody can bend."""
    name = model.names[joint]
    if name not in robot.keyframes["ready"] or robot.joint(name).type != "hinge":
        return 0.0  # the root, or a joint that follows others
    return float(data.oMi[joint].rotation[1] @ np.asarray(robot.joint(name).axis))
